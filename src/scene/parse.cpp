// SPDX-License-Identifier: MIT
// In: a RawTable. Out: a SceneConfig and the places of its keys. Every value is checked against its KeySpec
// before any is stored; they are stored in the schema's order, so that a preset comes before the keys that
// beat it.
#include "src/scene/parse.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "firn/error.h"
#include "src/scene/schema.h"
#include "src/scene/suggest.h"

namespace firn {
namespace {

// Products of two such numbers, and of one with the mass of a particle, are still normal floats.
constexpr double kSmallest = 1e-15, kLargest = 1e15;
constexpr double kLongest = 1e11;  // m; the volume of a particle is a normal float too

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::usage, where, what);
}

std::string unit_words(const KeySpec& key) {
  const std::string unit = key.notes.unit;
  if (unit.empty()) return "";
  if (key.type == ValueType::vector) return " (" + unit + ")";
  static const std::map<std::string, std::string> kNames = {{"m", "metres"}, {"s", "seconds"}};
  const auto name = kNames.find(unit);
  return " in " + (name == kNames.end() ? unit : name->second);
}

[[noreturn]] void refuse_type(const KeySpec& key, const RawValue& raw) {
  refuse(raw.where,
         "'" + key.name + "': expected " + type_text(key) + unit_words(key) + ", got " + describe(raw));
}

double checked(const KeySpec& key, const RawValue& raw, double x) {
  const double most = std::string_view(key.notes.unit) == "m" ? kLongest : kLargest;
  if (x != 0 && !(std::abs(x) >= kSmallest && std::abs(x) <= most)) {
    refuse(raw.where, "'" + key.name + "' is " + value_toml(x, ValueType::number) +
                          ", which single precision cannot calculate with: it must be 0 or of a size from " +
                          value_toml(kSmallest, ValueType::number) + " to " +
                          value_toml(most, ValueType::number));
  }
  if (!key.notes.range.holds(x)) {
    const std::string unit = *key.notes.unit ? std::string(" ") + key.notes.unit : "";
    refuse(raw.where, "'" + key.name + "' is " + value_toml(x, ValueType::number) +
                          ", out of range: it must be " + key.notes.range.text() + unit);
  }
  return x;
}

double number(const KeySpec& key, const RawValue& raw) {
  if (const auto* integer = std::get_if<std::int64_t>(&raw.value)) {
    return checked(key, raw, static_cast<double>(*integer));
  }
  if (const auto* real = std::get_if<double>(&raw.value)) {
    if (!std::isfinite(*real)) refuse(raw.where, "'" + key.name + "' is not a finite number");
    return checked(key, raw, *real);
  }
  refuse_type(key, raw);
}

std::int64_t whole_number(const KeySpec& key, const RawValue& raw) {
  const auto* integer = std::get_if<std::int64_t>(&raw.value);
  if (!integer) refuse_type(key, raw);
  if (!key.notes.range.holds(static_cast<double>(*integer))) {
    refuse(raw.where, "'" + key.name + "' is " + std::to_string(*integer) + ", out of range: it must be " +
                          key.notes.range.text());
  }
  return *integer;
}

std::string text(const KeySpec& key, const RawValue& raw) {
  const auto* string = std::get_if<std::string>(&raw.value);
  if (!string) refuse_type(key, raw);
  const auto& choices = key.notes.choices;
  if (!choices.empty() && std::count(choices.begin(), choices.end(), *string) == 0) {
    const std::string known = type_text(key).substr(key.type == ValueType::list ? 2 : 0);
    refuse(raw.where, "'" + key.name + "': expected " + known + ", got '" + *string + "'" +
                          suggestion(*string, choices));
  }
  return *string;
}

Vec3 vector(const KeySpec& key, const RawValue& raw) {
  if (key.type == ValueType::color && !raw.array()) return Vec3::Constant(number(key, raw));
  if (!raw.array() || raw.array()->size() != 3) refuse_type(key, raw);
  Vec3 result;
  for (int k = 0; k < 3; ++k) {
    const RawValue& item = (*raw.array())[k];
    if (!std::holds_alternative<double>(item.value) && !std::holds_alternative<std::int64_t>(item.value)) {
      refuse(item.where, "'" + key.name + "': expected 3 numbers" + unit_words(key) + ", got " +
                             describe(item) + " among them");
    }
    result[k] = number(key, item);
  }
  return result;
}

std::vector<std::string> list(const KeySpec& key, const RawValue& raw) {
  if (!raw.array()) refuse_type(key, raw);
  std::vector<std::string> items;
  for (const RawValue& item : *raw.array()) items.push_back(text(key, item));
  return items;
}

// What one key frame says: its time, its position and one vector more.
const KeySpec kKeyTime = {"time", ValueType::number, {.unit = "s", .range = at_least(0)}, {}, {}};
const KeySpec kKeyPosition = {"position", ValueType::vector, {.unit = "m"}, {}, {}};
const KeySpec kKeyRotation = {"rotation", ValueType::vector, {.unit = "degrees"}, {}, {}};
const KeySpec kKeyTarget = {"target", ValueType::vector, {.unit = "m"}, {}, {}};

template <class Frame>
Frame key_frame(const KeySpec& key, const RawValue& raw, const KeySpec& other, Vec3 Frame::*value) {
  if (!raw.table()) refuse_type(key, raw);
  Frame frame;
  for (const RawEntry& entry : raw.table()->entries) {
    if (entry.key == kKeyTime.name) {
      frame.time = number(kKeyTime, entry.value);
    } else if (entry.key == kKeyPosition.name) {
      frame.position = vector(kKeyPosition, entry.value);
    } else if (entry.key == other.name) {
      frame.*value = vector(other, entry.value);
    } else {
      refuse(entry.where, "unknown key '" + entry.key + "' in '" + key.name + "'" +
                              suggestion(entry.key, {kKeyTime.name, kKeyPosition.name, other.name}));
    }
  }
  if (!raw.table()->find("time"))
    refuse(raw.where, "a key frame of '" + key.name + "' lacks 'time', in seconds");
  return frame;
}

template <class Frame>
std::vector<Frame> key_frames(const KeySpec& key, const RawValue& raw, const KeySpec& other,
                              Vec3 Frame::*value) {
  if (!raw.array() || raw.array()->empty()) refuse_type(key, raw);
  std::vector<Frame> frames;
  for (const RawValue& item : *raw.array()) {
    frames.push_back(key_frame(key, item, other, value));
    if (frames.size() > 1 && frames.back().time <= frames[frames.size() - 2].time) {
      refuse(item.where, "'" + key.name + "': the times of the key frames do not ascend");
    }
  }
  return frames;
}

// Of a camera: where it is and what it looks at, both.
std::vector<CameraKey> camera_keys(const KeySpec& key, const RawValue& raw) {
  std::vector<CameraKey> keys = key_frames(key, raw, kKeyTarget, &CameraKey::target);
  for (const RawValue& item : *raw.array()) {
    for (const KeySpec* part : {&kKeyPosition, &kKeyTarget}) {
      if (item.table()->find(part->name)) continue;
      refuse(item.where, "a key frame of '" + key.name + "' lacks '" + part->name + "', 3 numbers (m)");
    }
  }
  return keys;
}

KeyValue convert(const KeySpec& key, const RawValue& raw) {
  switch (key.type) {
    case ValueType::boolean:
      if (!std::holds_alternative<bool>(raw.value)) refuse_type(key, raw);
      return std::get<bool>(raw.value);
    case ValueType::integer:
      return whole_number(key, raw);
    case ValueType::number:
      return number(key, raw);
    case ValueType::text:
      return text(key, raw);
    case ValueType::list:
      return list(key, raw);
    case ValueType::key_frames:
      return key_frames(key, raw, kKeyRotation, &KeyFrameConfig::rotation);
    case ValueType::camera_keys:
      return camera_keys(key, raw);
    default:
      return vector(key, raw);
  }
}

std::vector<std::string> key_names(const TableSpec& table) {
  std::vector<std::string> names;
  for (const KeySpec& key : table.keys) names.push_back(key.name);
  return names;
}

// A record of the scene that is being filled: the table's spec and its number.
struct Record {
  SceneConfig& scene;
  const TableSpec& table;
  std::size_t index;
  std::map<std::string, KeyValue> given = {};

  std::string title() const {
    const auto name = given.find("name");
    const std::string heading = table.name.empty() ? "the scene" : table.heading();
    return name == given.end() ? heading : heading + " '" + std::get<std::string>(name->second) + "'";
  }

  void read(const RawEntry& entry) {
    const KeySpec* key = table.find(entry.key);
    if (!key) {
      const std::string in = table.name.empty() ? "" : " in " + table.heading();
      refuse(entry.where, "unknown key '" + entry.key + "'" + in + suggestion(entry.key, key_names(table)));
    }
    scene.places[key_path(table, index, entry.key)] = entry.where;
    const auto* word = std::get_if<std::string>(&entry.value.value);
    if (word && *key->notes.absent_word && *word == key->notes.absent_word) return;
    given.emplace(entry.key, convert(*key, entry.value));
  }

  void store() {
    for (const KeySpec& key : table.keys) {
      const auto value = given.find(key.name);
      if (value != given.end()) key.set(scene, index, value->second);
    }
  }

  // Required keys are there; keys of another shape or type are not.
  void check(const std::string& where) const {
    for (const KeySpec& key : table.keys) {
      const bool is_given = given.count(key.name) > 0, has_meaning = applies(table, key, scene, index);
      if (is_given && !has_meaning) refuse_stray(key);
      if (!is_given && has_meaning && key.notes.required) {
        refuse(where, title() + " lacks '" + key.name + "', " + type_text(key) + unit_words(key) + ": " +
                          key.notes.meaning);
      }
    }
  }

  [[noreturn]] void refuse_stray(const KeySpec& key) const {
    const Condition& with = key.notes.with;
    std::string owners;
    for (const std::string& value : with.values) owners += (owners.empty() ? "" : " or ") + value;
    const auto now = table.find(with.key)->get(scene, index);
    refuse(scene.places.at(key_path(table, index, key.name)),
           "'" + key.name + "' belongs to " + with.key + " = " + owners + ", but this one has " + with.key +
               " = " + (now ? std::get<std::string>(*now) : "nothing"));
  }
};

void parse_record(SceneConfig& scene, const TableSpec& table, const RawTable& raw, const std::string& where) {
  const std::size_t index = table.repeated ? table.count(scene) : 0;
  if (table.count(scene) <= index) table.add(scene);
  scene.places[key_path(table, index)] = where;
  Record record{scene, table, index};
  for (const RawEntry& entry : raw.entries) record.read(entry);
  record.store();
  record.check(where);
}

void parse_table(SceneConfig& scene, const TableSpec& table, const RawEntry& entry) {
  if (!table.repeated) {
    if (!entry.value.table())
      refuse(entry.where, "'" + table.name + "' is a table: write [" + table.name + "]");
    return parse_record(scene, table, *entry.value.table(), entry.value.where);
  }
  if (!entry.value.array()) {
    refuse(entry.where, "there may be several of these: write [[" + table.name + "]], in two brackets");
  }
  for (const RawValue& item : *entry.value.array()) {
    if (!item.table())
      refuse(item.where, "'" + table.name + "' is a list of tables: write [[" + table.name + "]]");
    parse_record(scene, table, *item.table(), item.where);
  }
}

[[noreturn]] void refuse_unknown(const RawEntry& entry) {
  std::vector<std::string> names = {"quick"};
  for (const TableSpec& table : schema()) names.push_back(table.name);
  for (const std::string& name : key_names(*find_table(""))) names.push_back(name);
  refuse(entry.where, std::string("unknown ") +
                          (entry.value.table() || entry.value.array() ? "table" : "key") + " '" + entry.key +
                          "'" + suggestion(entry.key, names));
}

}  // namespace

SceneConfig parse_scene(const RawTable& root, const std::string& file) {
  SceneConfig scene;
  scene.file = file;
  RawTable top;
  for (const RawEntry& entry : root.entries) {
    const TableSpec* table = find_table(entry.key);
    if (entry.key == "quick") continue;
    if (table && !entry.key.empty()) {
      parse_table(scene, *table, entry);
    } else if (find_table("")->find(entry.key)) {
      top.entries.push_back(entry);
    } else {
      refuse_unknown(entry);
    }
  }
  parse_record(scene, *find_table(""), top, file + ":1:1");
  return scene;
}

}  // namespace firn
