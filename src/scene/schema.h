// SPDX-License-Identifier: MIT
// The one table of everything a scene file may say: name, type, unit, range, default, meaning and place in
// SceneConfig. Parsing, range checks, --set, [quick], resolved scenes, `firn params` and docs/scene_format.md
// all walk this table, so that none of them can know a key that the others do not.
#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "src/scene/config.h"

namespace firn {

enum class ValueType { boolean, integer, number, text, vector, color, list, key_frames, camera_keys };
using KeyValue = std::variant<bool, std::int64_t, double, std::string, Vec3, std::vector<std::string>,
                              std::vector<KeyFrameConfig>, std::vector<CameraKey>>;

// The allowed numbers; of a vector, of each component.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;

  bool holds(double x) const { return (low_open ? x > low : x >= low) && (high_open ? x < high : x <= high); }
  bool everything() const { return low == -std::numeric_limits<double>::infinity() && high == -low; }
  std::string text() const;  // "> 0", "0 to 1", ...
};
inline Range at_least(double low) { return {low, std::numeric_limits<double>::infinity(), false, false}; }
inline Range above(double low) { return {low, std::numeric_limits<double>::infinity(), true, false}; }
inline Range between(double low, double high) { return {low, high, false, false}; }

// The key has a meaning only where another key of its table has one of these values.
struct Condition {
  std::string key;  // empty: always
  std::vector<std::string> values;
};

// What a person should know about a key.
struct KeyNotes {
  const char* unit = "";
  Range range = {};
  std::vector<std::string> choices = {};
  Condition with = {};
  bool required = false;         // where `with` holds
  const char* absent = "";       // what happens without it, where that is not a value
  const char* absent_word = "";  // a word that may be written for that: "auto"
  const char* meaning = "";
};

struct KeySpec {
  std::string name;
  ValueType type;
  KeyNotes notes;
  std::function<void(SceneConfig&, std::size_t index, const KeyValue&)> set;
  std::function<std::optional<KeyValue>(const SceneConfig&, std::size_t index)> get;  // empty: absent
};

struct TableSpec {
  std::string name;  // empty: the top level of the file
  bool repeated;     // written [[name]], any number of times
  const char* meaning;
  std::vector<KeySpec> keys;
  std::function<std::size_t(const SceneConfig&)> count;  // of records that are there
  std::function<void(SceneConfig&)> add;                 // makes one more record

  const KeySpec* find(const std::string& key) const;
  std::string heading() const { return repeated ? "[[" + name + "]]" : "[" + name + "]"; }
};

const std::vector<TableSpec>& schema();
const TableSpec* find_table(const std::string& name);

// Whether `key` has a meaning in record `index`, given the values of the other keys.
bool applies(const TableSpec& table, const KeySpec& key, const SceneConfig& scene, std::size_t index);

// "simulation.dx", "snow[0].radius", "name": the names of SceneConfig::places. Without a key, the table's
// own.
std::string key_path(const TableSpec& table, std::size_t index, const std::string& key = "");

std::string default_text(const TableSpec& table, const KeySpec& key);  // for people
std::string type_text(const KeySpec& key);                             // "3 numbers", "one of ball, box", ...
std::string value_toml(const KeyValue& value, ValueType type);

}  // namespace firn
