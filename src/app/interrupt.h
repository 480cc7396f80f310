// SPDX-License-Identifier: MIT
// Ctrl-C and SIGTERM as a flag that every stage of a session polls; a second one ends the program at once.
// Where nobody polls (commands that only print, and what comes before a session) the first one does.
#pragma once
#include <atomic>
#include <filesystem>
#include <vector>

namespace firn {

std::atomic<bool>& stop_flag();  // whoever asks for it polls it
void catch_signals();            // also turns SIGPIPE and a file size limit into plain write errors

// Folders that a signal takes along, the innermost last, if they are empty; an empty list takes the last ones
// back.
void remove_when_interrupted(const std::vector<std::filesystem::path>& folders);

}  // namespace firn
