// SPDX-License-Identifier: MIT
// TOML text as a plain tree in which every key and value knows where it was written. The rest of the room
// works on this tree, so that a value from the scene file, from its [quick] table and from the command line
// pass the same checks, and so that the TOML library stays in one source file.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace firn {

struct RawValue;
struct RawEntry;
using RawArray = std::vector<RawValue>;

struct RawTable {
  std::vector<RawEntry> entries;  // in the order of the file

  RawValue* find(std::string_view key);
  const RawValue* find(std::string_view key) const;
  RawValue& set(const std::string& key, const std::string& key_where, RawValue value);  // adds or replaces
  void erase(std::string_view key);
};

struct OtherTomlType {
  std::string name;  // "a date", ...
};

struct RawValue {
  std::variant<bool, std::int64_t, double, std::string, RawArray, RawTable, OtherTomlType> value;
  std::string where;  // "scene.toml:12:3", or the override that it came from

  const RawTable* table() const { return std::get_if<RawTable>(&value); }
  RawTable* table() { return std::get_if<RawTable>(&value); }
  const RawArray* array() const { return std::get_if<RawArray>(&value); }
  RawArray* array() { return std::get_if<RawArray>(&value); }
};

struct RawEntry {
  std::string key;
  std::string where;  // of the key
  RawValue value;
};

// What a value is, for error messages: "the string \"wide\"", "an array of 2".
std::string describe(const RawValue& value);

// Errors: usage Error at the place of the syntax error.
RawTable parse_toml(std::string_view text, const std::string& file);

// The value of a --set: TOML, or else, if it is a bare word, a string. Everything in it is placed at `where`.
RawValue parse_toml_value(const std::string& text, const std::string& where);

}  // namespace firn
