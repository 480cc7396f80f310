// SPDX-License-Identifier: MIT
// Ctrl-C and SIGTERM as a flag that every stage polls. A second one ends the program at once.
#pragma once
#include <atomic>

namespace firn {

std::atomic<bool>& stop_flag();
void catch_signals();  // also turns SIGPIPE and a file size limit into plain write errors

}  // namespace firn
