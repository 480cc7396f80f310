// SPDX-License-Identifier: MIT
#include "src/scene/value.h"

#include <utility>
#include <variant>

namespace firn {
namespace {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

RawArray raw_array(const Value::Array& values, const std::string& where) {
  RawArray items;
  for (const Value& value : values) items.push_back(raw(value, where));
  return items;
}

RawTable raw_table(const Table& keys, const std::string& where) {
  RawTable table;
  for (const Key& key : keys) {
    if (table.find(key.name))
      throw Error(ErrorCode::usage, where, "the key '" + key.name + "' is given twice");
    table.set(key.name, where, raw(key.value, where));
  }
  return table;
}

}  // namespace

RawValue raw(const Value& value, const std::string& where) {
  RawValue result{false, where};
  std::visit(Overloaded{[&](const Value::Array& values) { result.value = raw_array(values, where); },
                        [&](const Table& keys) { result.value = raw_table(keys, where); },
                        [&](const auto& plain) { result.value = plain; }},
             value.variant());
  return result;
}

Value::Value(bool value) : value_(value) {}
Value::Value(Whole whole) : value_(whole.value) {}
Value::Value(double value) : value_(value) {}
Value::Value(const char* text) : value_(std::string(text)) {}
Value::Value(std::string text) : value_(std::move(text)) {}
Value::Value(Array values) : value_(std::move(values)) {}
Value::Value(Table keys) : value_(std::move(keys)) {}
Value::Value(std::initializer_list<double> numbers) : value_(Array(numbers.begin(), numbers.end())) {}
Value::Value(std::initializer_list<std::string> texts) : value_(Array(texts.begin(), texts.end())) {}
Value::Value(std::initializer_list<Table> tables) : value_(Array(tables.begin(), tables.end())) {}

Error Value::too_large() {
  return Error(ErrorCode::usage, "", "a whole number of a scene is below 2^63 = 9223372036854775808");
}

}  // namespace firn
