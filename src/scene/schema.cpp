// SPDX-License-Identifier: MIT
// Puts the table together and answers questions about it.
#include "src/scene/schema.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "src/scene/schema_tables.h"

namespace firn {
namespace {

// The shortest text that reads back to the same number; whole numbers without an exponent.
template <class T>
std::string digits(T x) {
  if (std::abs(x) < T(1e9) && x == std::floor(x)) return std::to_string(static_cast<std::int64_t>(x));
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), x).ptr;
  return {buffer, end};
}

template <class T>
std::string toml_number(T x) {
  const std::string text = digits(x);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    const auto code = static_cast<unsigned char>(c);
    if (c == '\n') {
      result += "\\n";
    } else if (c == '\t') {
      result += "\\t";
    } else if (code < ' ' || code == 0x7F) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04X", code);
      result += escape;
    } else {
      result += c;
    }
  }
  return result + '"';
}

struct TomlText {
  ValueType type;
  std::string operator()(bool b) const { return b ? "true" : "false"; }
  std::string operator()(std::int64_t i) const { return std::to_string(i); }
  std::string operator()(double x) const { return toml_number(x); }
  std::string operator()(const std::string& text) const { return quoted(text); }
  std::string operator()(const Vec3& v) const {
    std::string result;
    for (int k = 0; k < 3; ++k) {
      result += (k ? ", " : "[") +
                (type == ValueType::color ? toml_number(static_cast<float>(v[k])) : toml_number(v[k]));
    }
    return result + "]";
  }
  std::string operator()(const std::vector<std::string>& list) const {
    std::string result = "[";
    for (const std::string& item : list) result += (result.size() > 1 ? ", " : "") + quoted(item);
    return result + "]";
  }
  std::string operator()(const std::vector<KeyFrameConfig>& keys) const {
    return key_frames(keys, "rotation", &KeyFrameConfig::rotation);
  }
  std::string operator()(const std::vector<CameraKey>& keys) const {
    return key_frames(keys, "target", &CameraKey::target);
  }
  template <class Key>
  std::string key_frames(const std::vector<Key>& keys, const char* other, Vec3 Key::*value) const {
    std::string result = "[";
    for (const Key& key : keys) {
      result += (result.size() > 1 ? ", {time = " : "{time = ") + toml_number(key.time) +
                ", position = " + (*this)(key.position) + ", " + other + " = " + (*this)(key.*value) + "}";
    }
    return result + "]";
  }
};

std::string joined(const std::vector<std::string>& words) {
  std::string result;
  for (const std::string& word : words) result += (result.empty() ? "" : ", ") + word;
  return result;
}

}  // namespace

const std::vector<TableSpec>& schema() {
  static const std::vector<TableSpec> all = [] {
    std::vector<TableSpec> tables = world_tables();
    for (TableSpec& table : picture_tables()) tables.push_back(std::move(table));
    return tables;
  }();
  return all;
}

const TableSpec* find_table(const std::string& name) {
  for (const TableSpec& table : schema()) {
    if (table.name == name) return &table;
  }
  return nullptr;
}

const KeySpec* TableSpec::find(const std::string& key) const {
  for (const KeySpec& spec : keys) {
    if (spec.name == key) return &spec;
  }
  return nullptr;
}

std::string Range::text() const {
  const bool bounded_low = std::isfinite(low), bounded_high = std::isfinite(high);
  if (bounded_low && bounded_high) {
    const char* join = high_open ? " to below " : " to ";
    return (low_open ? "above " : "") + digits(low) + join + digits(high);
  }
  if (bounded_low) return (low_open ? "above " : "at least ") + digits(low);
  return "at most " + digits(high);
}

bool applies(const TableSpec& table, const KeySpec& key, const SceneConfig& scene, std::size_t index) {
  const Condition& with = key.notes.with;
  if (with.key.empty()) return true;
  const auto value = table.find(with.key)->get(scene, index);
  return value && std::count(with.values.begin(), with.values.end(), std::get<std::string>(*value)) > 0;
}

std::string key_path(const TableSpec& table, std::size_t index, const std::string& key) {
  std::string path = table.name;
  if (table.repeated) path.append("[").append(std::to_string(index)).append("]");
  if (key.empty()) return path;
  return path.empty() ? key : path + "." + key;
}

std::string default_text(const TableSpec& table, const KeySpec& key) {
  if (*key.notes.absent) return key.notes.absent;
  if (key.notes.required) return "required";
  SceneConfig scene;
  if (table.count(scene) == 0) table.add(scene);
  const auto value = key.get(scene, 0);
  return value ? value_toml(*value, key.type) : "none";
}

std::string type_text(const KeySpec& key) {
  if (key.type == ValueType::list) return "a list of " + joined(key.notes.choices);
  if (!key.notes.choices.empty()) return "one of " + joined(key.notes.choices);
  switch (key.type) {
    case ValueType::boolean:
      return "true or false";
    case ValueType::integer:
      return "a whole number";
    case ValueType::number:
      return "a number";
    case ValueType::vector:
      return "3 numbers";
    case ValueType::key_frames:
      return "a list of {time = 0.0, position = [0, 0, 0], rotation = [0, 0, 0]}";
    case ValueType::camera_keys:
      return "a list of {time = 0.0, position = [0, 0, 0], target = [0, 0, 0]}";
    case ValueType::color:
      return "a number or 3 numbers (red, green, blue)";
    default:
      return "a string";
  }
}

std::string value_toml(const KeyValue& value, ValueType type) { return std::visit(TomlText{type}, value); }

}  // namespace firn
