// SPDX-License-Identifier: MIT
// Completion for fish, one line a word.
#include "src/app/manual/manual.h"

namespace firn {
namespace {

const char* const kFishFunctions = R"fish(
function __firn_scenes
    __fish_complete_suffix .toml
end

# Folders of runs and those that hold some; where there are none, all folders.
function __firn_runs
    set -l folders (__fish_complete_directories (commandline -ct) '')
    set -l runs
    for folder in $folders
        set -l path (string replace -r '\t.*' '' -- $folder | string replace -r '^~/' "$HOME/")
        set -l found $path/run.json $path/*/run.json $path/*/*/run.json
        for file in $found
            if test -e $file
                set -a runs $folder
                break
            end
        end
    end
    if set -q runs[1]
        printf '%s\n' $runs
    else if set -q folders[1]
        printf '%s\n' $folders
    end
end

function __firn_key_values
    __firn_keys | string replace -r '\t' '=\t'
    __firn_values
end
)fish";

std::string fish_quoted(const std::string& text) {
  return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string candidates(Completes kind, const std::string& placeholder) {
  switch (kind) {
    case Completes::choices:
      return "'" + joined(choices_of(placeholder)) + "'";
    case Completes::scene:
      return "'(__firn_scenes)'";
    case Completes::run:
      return "'(__firn_runs)'";
    case Completes::run_or_scene:
      return "'(__firn_runs; __firn_scenes)'";
    case Completes::folder:
      return "'(__fish_complete_directories (commandline -ct))'";
    case Completes::key_value:
      return "'(__firn_key_values)'";
    case Completes::key:
      return "'(__firn_keys)'";
    case Completes::nothing:
      break;
  }
  return "";
}

std::string fish_option(const std::string& condition, const OptionWords& option) {
  std::string line = "complete -c firn -n '" + condition + "'";
  if (!option.short_name.empty()) line += " -s " + option.short_name.substr(1);
  line += " -l " + option.name.substr(2) + " -d " + fish_quoted(option.meaning);
  if (!option.value.empty()) {
    const std::string words = candidates(completes(option.value), option.value);
    line += " -x" + (words.empty() ? "" : " -a " + words);
  }
  return line + "\n";
}

std::string fish_keys() {
  std::string keys = "\nfunction __firn_keys\n    printf '%s\\t%s\\n'";
  std::string values = "\nfunction __firn_values\n    printf '%s\\n'";
  for (const KeyWords& key : scene_keys()) {
    keys += " \\\n        " + key.name + " " + fish_quoted(key.meaning);
    for (const std::string& value : key.values) values += " \\\n        " + key.name + "=" + value;
  }
  return keys + "\nend\n" + values + "\nend\n";
}

std::string lines_of(const CommandWords& command) {
  const std::string condition = "__fish_seen_subcommand_from " + command.name;
  std::string text = "\ncomplete -c firn -n __fish_use_subcommand -a " + command.name + " -d " +
                     fish_quoted(command.meaning) + "\n";
  for (const OptionWords& operand : command.operands) {
    const std::string words = candidates(completes(operand.name), operand.name);
    if (!words.empty()) text += "complete -c firn -n '" + condition + "' -a " + words + "\n";
  }
  for (const OptionWords& option : command.options) text += fish_option(condition, option);
  return text;
}

}  // namespace

std::string fish_completion(const CommandLine& words) {
  std::string text = "# fish completion for firn, made of its command line and its schema\n" + fish_keys() +
                     kFishFunctions + "\ncomplete -c firn -f\n";
  for (const OptionWords& option : words.program.options)
    text += fish_option("__fish_use_subcommand", option);
  std::string names;
  for (const CommandWords& command : words.commands) {
    text += lines_of(command);
    names += (names.empty() ? "" : " ") + command.name;
  }
  return text + "\ncomplete -c firn -n __fish_use_subcommand -a help -d 'Print what a command takes'\n" +
         "complete -c firn -n '__fish_seen_subcommand_from help' -a '" + names + "'\n";
}

}  // namespace firn
