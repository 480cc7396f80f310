// SPDX-License-Identifier: MIT
// From the tables of the command line and of the schema to what completions ask.
#include <algorithm>
#include <cctype>
#include <utility>

#include "firn/error.h"
#include "src/app/manual/manual.h"
#include "src/scene/schema.h"

namespace firn {
namespace {

constexpr std::pair<const char*, Completes> kPlaceholders[] = {
    {"SCENE", Completes::scene},         {"RUN", Completes::run},     {"RUN|SCENE", Completes::run_or_scene},
    {"DIR", Completes::folder},          {"WORD", Completes::key},    {"N", Completes::nothing},
    {"KEY=VALUE", Completes::key_value}, {"A-B", Completes::nothing},
};

std::vector<std::string> values_of(const KeySpec& key) {
  if (key.type == ValueType::boolean) return {"false", "true"};
  return key.type == ValueType::text ? key.notes.choices : std::vector<std::string>();
}

}  // namespace

Completes completes(const std::string& placeholder) {
  for (const auto& [name, kind] : kPlaceholders) {
    if (placeholder == name) return kind;
  }
  if (!placeholder.empty() && std::islower(static_cast<unsigned char>(placeholder[0])) != 0)
    return Completes::choices;
  throw Error(ErrorCode::failed, "", "completions do not know what '" + placeholder + "' stands for");
}

std::vector<std::string> choices_of(const std::string& placeholder) {
  std::vector<std::string> choices(1);
  for (const char letter : placeholder) {
    if (letter == '|') {
      choices.emplace_back();
    } else {
      choices.back() += letter;
    }
  }
  return choices;
}

std::vector<KeyWords> scene_keys() {
  std::vector<KeyWords> keys;
  for (const TableSpec& table : schema()) {
    for (const KeySpec& key : table.keys) {
      const std::string name = table.name.empty() ? key.name : table.name + "." + key.name;
      keys.push_back({name, key.notes.meaning, values_of(key)});
    }
  }
  return keys;
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string completing_function(Completes kind) {
  switch (kind) {
    case Completes::scene:
      return "_firn_paths .toml";
    case Completes::run:
      return "_firn_runs";
    case Completes::run_or_scene:
      return "_firn_runs .toml";
    case Completes::folder:
      return "_firn_paths";
    case Completes::key_value:
      return "_firn_key_values";
    case Completes::key:
      return "_firn_keys";
    case Completes::choices:
    case Completes::nothing:
      break;
  }
  return "";
}

std::vector<std::string> spellings(const OptionWords& option) {
  if (option.short_name.empty()) return {option.name};
  return {option.short_name, option.name};
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::vector<OptionWords> options_with_values(const CommandLine& words) {
  std::vector<OptionWords> found;
  for (const CommandWords& command : words.commands) {
    for (const OptionWords& option : command.options) {
      const bool known = std::any_of(found.begin(), found.end(),
                                     [&](const OptionWords& other) { return other.name == option.name; });
      if (!option.value.empty() && !known) found.push_back(option);
    }
  }
  return found;
}

}  // namespace firn
