// SPDX-License-Identifier: MIT
// Completion for zsh, by its own _arguments.
#include "src/app/manual/manual.h"

namespace firn {
namespace {

const char* const kZshFunctions = R"zsh(
# Folders, and the files that end with one of the given words.
_firn_paths() {
  if (( $# )); then _files -g "*(${(j:|:)@})(-.)"; else _files -/; fi
}

# Whether a folder is a run or holds some.
_firn_holds_runs() {
  local -a runs=($REPLY/{run.json,*/run.json,*/*/run.json}(N))
  (( $#runs ))
}

# Folders of runs and those that hold some; where there are none, all folders.
_firn_runs() {
  local -a patterns=("*(-/+_firn_holds_runs)")
  (( ! $# )) || patterns+=("*(${(j:|:)@})(-.)")
  _path_files -g "$patterns" || _files -/
}

_firn_key_values() {
  local key=${PREFIX%%=*}
  if compset -P 1 '*='; then
    compadd -- $(_firn_values $key)
  else
    _firn_keys -S =
  fi
}
)zsh";

// Inside of single quotes and of [...] or (...) of a specification.
std::string zsh_quoted(std::string text) {
  for (const char* special : {"\\", "[", "]", ":"})
    text = replaced(text, special, std::string("\\") + special);
  return replaced(text, "'", "'\\''");
}

std::string zsh_action(Completes kind, const std::string& placeholder) {
  switch (kind) {
    case Completes::choices:
      return "(" + joined(choices_of(placeholder)) + ")";
    case Completes::nothing:
      return " ";  // a value that nothing is known of
    default:
      return completing_function(kind);
  }
}

std::string specification(const OptionWords& option) {
  const std::string meaning = "[" + zsh_quoted(option.meaning) + "]";
  const std::string value = option.value.empty() ? ""
                                                 : ":" + zsh_quoted(option.value) + ":" +
                                                       zsh_action(completes(option.value), option.value);
  std::string text;
  for (const std::string& name : spellings(option)) {
    const std::string assigned = option.value.empty() ? "" : "=";
    text += " \\\n        '" + std::string(option.repeatable ? "*" : "") + name + assigned + meaning + value +
            "'";
  }
  return text;
}

std::string case_of(const CommandWords& command) {
  std::string text = "      (" + command.name + ")\n        _arguments";
  for (const OptionWords& option : command.options) text += specification(option);
  for (const OptionWords& operand : command.operands) {
    text += " \\\n        '" + std::string(operand.required ? "1:" : "1::") + zsh_quoted(operand.name) + ":" +
            zsh_action(completes(operand.name), operand.name) + "'";
  }
  return text + "\n        ;;\n";
}

std::string commands_function(const CommandLine& words) {
  std::string text = "\n_firn_commands() {\n  local -a commands=(\n";
  for (const CommandWords& command : words.commands) {
    text += "    '" + command.name + ":" + zsh_quoted(command.meaning) + "'\n";
  }
  return text + "    'help:Print what a command takes'\n  )\n  _describe command commands\n}\n";
}

std::string zsh_keys() {
  std::string keys = "\n_firn_keys() {\n  local -a keys=(\n";
  std::string values = "\n_firn_values() {\n  case $1 in\n";
  for (const KeyWords& key : scene_keys()) {
    keys += "    '" + key.name + ":" + zsh_quoted(key.meaning) + "'\n";
    if (!key.values.empty()) values += "    (" + key.name + ") print -l " + joined(key.values) + " ;;\n";
  }
  return keys + "  )\n  _describe key keys \"$@\"\n}\n" + values + "  esac\n}\n";
}

std::string main_function(const CommandLine& words) {
  std::string text =
      "\n_firn() {\n  local curcontext=$curcontext state line\n  typeset -A opt_args\n  _arguments -C";
  for (const OptionWords& option : words.program.options) text += specification(option);
  text +=
      " \\\n        '1:command:_firn_commands' \\\n        '*::operand:->operands'\n"
      "  if [[ $state == operands ]]; then\n    case $line[1] in\n";
  for (const CommandWords& command : words.commands) text += case_of(command);
  return text + "      (help) _arguments '1:command:_firn_commands' ;;\n    esac\n  fi\n}\n\n_firn \"$@\"\n";
}

}  // namespace

std::string zsh_completion(const CommandLine& words) {
  return "#compdef firn\n# zsh completion for firn, made of its command line and its schema\n" +
         commands_function(words) + zsh_keys() + kZshFunctions + main_function(words);
}

}  // namespace firn
