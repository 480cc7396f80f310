// SPDX-License-Identifier: MIT
// The command line as a table, read back from what parses it: the man page and the completions are made of
// it.
#pragma once
#include <string>
#include <vector>

namespace firn {

struct OptionWords {
  std::string name;        // "--out"; of an operand "SCENE"
  std::string short_name;  // "-h", or empty
  std::string value;  // "DIR", or in small letters what it may be: "auto|base"; empty: a flag or an operand
  std::string meaning;
  bool required = false;
  bool repeatable = false;
};

struct CommandWords {
  std::string name;
  std::string meaning;
  std::vector<OptionWords> operands;
  std::vector<OptionWords> options;
};

struct CommandLine {
  CommandWords program;  // its options stand alone, without a command
  std::vector<CommandWords> commands;
};

CommandLine command_line();

}  // namespace firn
