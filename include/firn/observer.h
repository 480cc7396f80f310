// SPDX-License-Identifier: MIT
// What a session tells whoever began it, while it is at work: the library prints nothing.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "firn/export.h"

namespace firn {

// What is done to a frame, in this order.
enum class Stage {
  simulate,  // its snow is stepped to its time
  trace,     // its picture is rendered
  write,     // its files are written
};

// What a thread did, when.
struct StageInterval {
  const char* stage;  // "simulate", "trace", "write"
  int frame;          // which frame it was for
  double begin;       // s since the start of the session
  double end;         // s, likewise
  int thread;         // of the session's
};

// Called from the threads of the session, stages from several at a time: what is overridden must be
// thread-safe, and is best brief, since the stage waits for it. What is not of interest stays as it is. An
// exception ends the session as one of its own would.
class FIRN_API Observer {
 public:
  virtual ~Observer();
  // A line for people; the log of the run has it too.
  virtual void message(const std::string&) {}
  // Folders that the session made, the innermost last, and that are empty as long as it has not begun; then
  // an empty list.
  virtual void made_folders(const std::vector<std::filesystem::path>&) {}
  // So many frames are to be made, each of `seconds` as a first guess. Ends with frames_end().
  virtual void frames_begin(int /*count*/, double /*seconds*/) {}
  virtual void frames_end() {}
  // A stage begins with a frame, and ends with it.
  virtual void stage_begins(Stage, int /*frame*/) {}
  virtual void stage_ends(Stage, int /*frame*/) {}
};

}  // namespace firn
