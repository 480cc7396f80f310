// SPDX-License-Identifier: MIT
// What a session tells whoever began it, while it is at work: nothing in this folder prints.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace firn {

enum class Stage { simulate, trace, write };

// Called from the threads of the session, stages from several at a time. What is not of interest stays as it
// is.
class Observer {
 public:
  virtual ~Observer() = default;
  // A line for people; the log of the run has it too.
  virtual void message(const std::string&) {}
  // Folders that the session made, the innermost last, and that are empty as long as it has not begun; then
  // an empty list.
  virtual void made_folders(const std::vector<std::filesystem::path>&) {}
  // So many frames are to be made, each of `seconds` as a first guess. Ends with frames_end().
  virtual void frames_begin(int /*count*/, double /*seconds*/) {}
  virtual void frames_end() {}
  virtual void stage_begins(Stage, int /*frame*/) {}
  virtual void stage_ends(Stage, int /*frame*/) {}
};

}  // namespace firn
