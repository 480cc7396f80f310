// SPDX-License-Identifier: MIT
// In: TOML text. Out: a RawTable with places. The only file that knows toml++.
#include "src/scene/toml_text.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <tuple>

#include "firn/error.h"
#include "src/scene/toml_depth.h"

namespace firn {
namespace {

constexpr int kMostLevels = 64;
constexpr std::size_t kMostQuoted = 40;  // bytes of a string in a message
constexpr const char* kTooDeep =
    "tables and arrays are nested deeper than 64 levels here; no key of a scene is so deep";

std::string place(const std::string& file, const toml::source_region& region) {
  return file + ":" + std::to_string(region.begin.line) + ":" + std::to_string(region.begin.column);
}

RawTable convert_table(const toml::table& table, const std::string& file);

RawValue convert(const toml::node& node, const std::string& file) {
  RawValue result{false, place(file, node.source())};
  if (const auto* boolean = node.as_boolean()) {
    result.value = boolean->get();
  } else if (const auto* integer = node.as_integer()) {
    result.value = integer->get();
  } else if (const auto* number = node.as_floating_point()) {
    result.value = number->get();
  } else if (const auto* text = node.as_string()) {
    result.value = text->get();
  } else if (const auto* array = node.as_array()) {
    RawArray items;
    for (const toml::node& item : *array) items.push_back(convert(item, file));
    result.value = std::move(items);
  } else if (const auto* table = node.as_table()) {
    result.value = convert_table(*table, file);
  } else {
    result.value = OtherTomlType{"a date or time"};
  }
  return result;
}

// toml++ keeps a table's keys sorted by name; people expect the first error of the file.
RawTable convert_table(const toml::table& table, const std::string& file) {
  std::vector<std::pair<toml::source_position, RawEntry>> entries;
  for (const auto& [key, node] : table) {
    entries.push_back(
        {key.source().begin, {std::string(key.str()), place(file, key.source()), convert(node, file)}});
  }
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  RawTable result;
  for (auto& [position, entry] : entries) result.entries.push_back(std::move(entry));
  return result;
}

std::string join_lines(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

void place_everything_at(RawValue& value, const std::string& where) {
  value.where = where;
  if (RawArray* array = value.array()) {
    for (RawValue& item : *array) place_everything_at(item, where);
  } else if (RawTable* table = value.table()) {
    for (RawEntry& entry : table->entries) {
      entry.where = where;
      place_everything_at(entry.value, where);
    }
  }
}

bool is_bare_word(const std::string& text) {
  return !text.empty() && std::none_of(text.begin(), text.end(), [](unsigned char c) {
    return c == '"' || c == '\'' || c == '[' || c == ']' || c == '{' || c == '}' || c == ',' || c < ' ';
  });
}

// Digits that TOML does not take: a number beyond 64 bits, or one that begins with 0.
bool is_whole_number(const std::string& text) {
  const std::size_t sign = text[0] == '-' || text[0] == '+' ? 1 : 0;
  return text.size() > sign && text.find_first_not_of("0123456789", sign) == std::string::npos;
}

}  // namespace

RawValue* RawTable::find(std::string_view key) {
  for (RawEntry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

const RawValue* RawTable::find(std::string_view key) const { return const_cast<RawTable*>(this)->find(key); }

RawValue& RawTable::set(const std::string& key, const std::string& key_where, RawValue value) {
  erase(key);
  entries.push_back({key, key_where, std::move(value)});
  return entries.back().value;
}

void RawTable::erase(std::string_view key) {
  std::erase_if(entries, [&](const RawEntry& entry) { return entry.key == key; });
}

std::string describe(const RawValue& raw) {
  struct Words {
    std::string operator()(bool) const { return "true or false"; }
    std::string operator()(std::int64_t) const { return "a whole number"; }
    std::string operator()(double) const { return "a number"; }
    std::string operator()(const std::string& s) const {
      return s.size() > kMostQuoted ? "a string" : "the string \"" + s + "\"";
    }
    std::string operator()(const RawArray& a) const { return "an array of " + std::to_string(a.size()); }
    std::string operator()(const RawTable&) const { return "a table"; }
    std::string operator()(const OtherTomlType& other) const { return other.name; }
  };
  return std::visit(Words{}, raw.value);
}

RawTable parse_toml(std::string_view text, const std::string& file) {
  if (const auto deep = find_deep_nesting(text, kMostLevels)) {
    throw Error(ErrorCode::usage,
                file + ":" + std::to_string(deep->line) + ":" + std::to_string(deep->column), kTooDeep);
  }
  try {
    return convert_table(toml::parse(text, std::string_view(file)), file);
  } catch (const toml::parse_error& error) {
    throw Error(ErrorCode::usage, place(file, error.source()), join_lines(std::string(error.description())));
  }
}

RawValue parse_toml_value(const std::string& text, const std::string& where) {
  RawValue result{text, where};
  if (find_deep_nesting(text, kMostLevels)) throw Error(ErrorCode::usage, where, kTooDeep);
  try {
    const std::string line = "value = " + text;
    const toml::table table = toml::parse(std::string_view(line));
    if (table.size() != 1) throw Error(ErrorCode::usage, where, "expected one value, got '" + text + "'");
    result = convert(*table.get("value"), where);
  } catch (const toml::parse_error& error) {
    if (!is_bare_word(text) || is_whole_number(text)) {
      throw Error(ErrorCode::usage, where,
                  "'" + text + "' is not a TOML value: " + join_lines(std::string(error.description())));
    }
  }
  place_everything_at(result, where);
  return result;
}

}  // namespace firn
