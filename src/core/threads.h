// SPDX-License-Identifier: MIT
// The threads of one owner, such as a session: several of them may be at work in a process without knowing of
// each other, and none changes a setting of the whole process.
#pragma once
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <thread>
#include <utility>

namespace firn {

class Threads {
 public:
  // As many as asked for, where the process allows them (tbb::global_control); 0 or less: as many as the
  // machine has.
  explicit Threads(int count = 0) : arena_(std::min(count_of(count), most())) {}

  static int count_of(int asked) {
    return asked > 0 ? asked : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }

  // f() with all its parallel loops and flow graphs, on the calling thread and the others. May be called from
  // several threads, which then share them.
  template <class F>
  auto run(F&& f) {
    return arena_.execute(std::forward<F>(f));
  }

 private:
  // More would be had no sooner, and oneTBB would print a warning.
  static int most() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  }

  tbb::task_arena arena_;
};

}  // namespace firn
