// SPDX-License-Identifier: MIT
// Ctrl-C and SIGTERM as a request to stop, for the sessions that run; a second one ends the program at once.
// Where no session runs yet, and in commands that only print, the first one does.
#pragma once
#include <filesystem>
#include <stop_token>
#include <vector>

namespace firn {

std::stop_token stop_of_signals();  // whoever asks for it stops when it is requested
void catch_signals();               // also turns SIGPIPE and a file size limit into plain write errors

// Folders that a signal takes along, the innermost last, if they are empty; an empty list takes the last ones
// back.
void remove_when_interrupted(const std::vector<std::filesystem::path>& folders);

}  // namespace firn
