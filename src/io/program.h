// SPDX-License-Identifier: MIT
// Other programs as child processes: their words as a vector, never through a shell, and what they say
// through a pipe.
#pragma once
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace firn {

struct Outcome {
  int status = -1;   // as of waitpid; -1 if it could not be started
  std::string said;  // stdout and stderr, the last part; why it could not be started
};

// Runs the words to their end, or ends the program when `stop` is set; nothing on stdin.
Outcome run_program(std::vector<std::string> words, const std::stop_token& stop = {});

std::optional<std::filesystem::path> find_program(const std::string& name);  // along the PATH
std::string shell_line(const std::vector<std::string>& words);  // quoted where needed, to be copied by people
std::string as_operand(const std::string& path);                // not to be taken for an option: "./-x"

}  // namespace firn
