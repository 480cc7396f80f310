// SPDX-License-Identifier: MIT
// Completion for bash 4.3 and later, with or without the package bash-completion. bash cuts words at "=", so
// the function puts them together again first, and takes off what bash has already at the end.
#include <cctype>

#include "src/app/manual/manual.h"

namespace firn {
namespace {

const char* const kBashFunctions = R"bash(
# All folders, and the files that end with one of the given words.
_firn_paths() {
  local path real ending
  while IFS= read -r path; do
    real=$path
    [[ $path != "~/"* ]] || real=$HOME/${path#"~/"}
    [[ ! -d $real ]] || COMPREPLY+=("$path")
    for ending; do
      [[ -d $real || $path != *"$ending" ]] || COMPREPLY+=("$path")
    done
  done < <(compgen -f -- "$current")
  compopt -o filenames 2>/dev/null
}

# Folders of runs and those that hold some; where there are none, all folders.
_firn_runs() {
  local path real found runs=()
  _firn_paths "$@"
  for path in "${COMPREPLY[@]}"; do
    real=$path
    [[ $path != "~/"* ]] || real=$HOME/${path#"~/"}
    for found in "$real"/run.json "$real"/*/run.json "$real"/*/*/run.json; do
      if [[ -e $found ]]; then
        runs+=("$path")
        break
      fi
    done
    [[ -d $real ]] || runs+=("$path")
  done
  ((${#runs[@]} == 0)) || COMPREPLY=("${runs[@]}")
}

_firn_words() { mapfile -t COMPREPLY < <(compgen -W "$1" -- "$current"); }

# A key and "=", or behind that its values.
_firn_key_values() {
  if [[ $current == *=* ]]; then
    local key=${current%%=*}
    mapfile -t COMPREPLY < <(compgen -P "$key=" -W "$(_firn_values "$key")" -- "${current#*=}")
  else
    mapfile -t COMPREPLY < <(compgen -S = -W "$(_firn_keys)" -- "$current")
    compopt -o nospace 2>/dev/null
  fi
}

_firn() {
  local words=() word i
  for ((i = 1; i <= COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if ((${#words[@]})) && [[ $word == "=" || (${COMP_WORDS[i - 1]} == "=" && -n $word) ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
  done
  local current=${words[-1]} command="" option="" before="" operands=0
  unset "words[-1]"
  for word in "${words[@]}"; do
    if [[ -n $option ]]; then
      option=""
    elif _firn_takes_value "$word"; then
      option=$word
    elif [[ $word == -* ]]; then
      continue
    elif [[ -z $command ]]; then
      command=$word
    else
      ((++operands))
    fi
  done
  if [[ -z $option && $current == --*=* ]] && _firn_takes_value "${current%%=*}"; then
    option=${current%%=*} before=${current%%=*}= current=${current#*=}
  fi
  local typed=$current
  case $current in
    \"*) current=${current#\"} ;;
    \'*) current=${current#\'} ;;
    *) current=${current//\\/} ;;
  esac
  COMPREPLY=()
  if [[ -n $option ]]; then
    _firn_value "$option"
  elif [[ $current == -* ]]; then
    _firn_words "$(_firn_options "$command")"
  elif [[ -z $command ]]; then
    _firn_words "$(_firn_commands)"
  elif ((operands == 0)); then
    _firn_operand "$command"
  fi
  # What stands before the last "=" is there already, where bash cuts words at it.
  local cut=""
  if [[ $COMP_WORDBREAKS == *"="* ]]; then
    before=""
    [[ $typed != *=* ]] || cut=${typed%=*}=
  fi
  for i in "${!COMPREPLY[@]}"; do COMPREPLY[i]=$before${COMPREPLY[i]#"$cut"}; done
}

complete -F _firn firn
)bash";

std::string bash_action(Completes kind, const std::string& placeholder) {
  switch (kind) {
    case Completes::choices:
      return "_firn_words \"" + joined(choices_of(placeholder)) + "\"";
    case Completes::key:
      return "_firn_words \"$(_firn_keys)\"";
    case Completes::nothing:
      return ":";
    default:
      return completing_function(kind);
  }
}

// A function that prints words, chosen by its argument.
struct Choice {
  std::string text;

  explicit Choice(const std::string& name) : text("\n" + name + "() {\n  case $1 in\n") {}
  void add(const std::string& pattern, const std::string& what) {
    text += "    " + pattern + ") " + what + " ;;\n";
  }
  std::string end() const { return text + "  esac\n}\n"; }
};

std::string said(const std::vector<std::string>& words) { return "echo \"" + joined(words) + "\""; }

std::string bash_options(const CommandLine& words) {
  Choice options("_firn_options");
  const auto add = [&options](const CommandWords& command, const std::string& pattern) {
    std::vector<std::string> names;
    for (const OptionWords& option : command.options) names.push_back(option.name);
    options.add(pattern, said(names));
  };
  add(words.program, "\"\"");
  for (const CommandWords& command : words.commands) add(command, command.name);
  return options.end();
}

std::string operand_function(const CommandLine& words) {
  Choice operand("_firn_operand");
  for (const CommandWords& command : words.commands) {
    if (command.operands.empty()) continue;
    const std::string& placeholder = command.operands[0].name;
    operand.add(command.name, bash_action(completes(placeholder), placeholder));
  }
  operand.add("help", "_firn_words \"$(_firn_commands)\"");
  return operand.end();
}

std::string value_functions(const CommandLine& words) {
  Choice value("_firn_value");
  std::vector<std::string> names;
  for (const OptionWords& option : options_with_values(words)) {
    value.add(option.name, bash_action(completes(option.value), option.value));
    names.push_back(option.name);
  }
  Choice takes("_firn_takes_value");
  takes.add(joined(names, "|"), "return 0");
  takes.add("*", "return 1");
  return value.end() + takes.end();
}

std::string bash_keys() {
  Choice values("_firn_values");
  std::string names;
  for (const KeyWords& key : scene_keys()) {
    names += "\n" + key.name;
    if (!key.values.empty()) values.add(key.name, said(key.values));
  }
  return "\n_firn_keys() {\n  echo \"" + names.substr(1) + "\"\n}\n" + values.end();
}

}  // namespace

std::string bash_completion(const CommandLine& words) {
  std::vector<std::string> commands;
  for (const CommandWords& command : words.commands) commands.push_back(command.name);
  commands.push_back("help");
  return "# bash completion for firn, made of its command line and its schema\n"
         "\n_firn_commands() { " +
         said(commands) + "; }\n" + bash_options(words) + operand_function(words) + value_functions(words) +
         bash_keys() + kBashFunctions;
}

}  // namespace firn
