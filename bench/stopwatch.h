// SPDX-License-Identifier: MIT
#pragma once
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace firn::bench {

// Seconds that work() takes.
template <class Work>
double seconds_of(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Seconds that the processors are busy with work(), on all threads.
template <class Work>
double cpu_seconds_of(Work&& work) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double begin = now();
  work();
  return now() - begin;
}

// The shortest of several times: what the code costs when nothing disturbs it.
class Best {
 public:
  void add(double seconds) { seconds_ = std::min(seconds_, seconds); }
  double seconds() const { return seconds_; }

 private:
  double seconds_ = INFINITY;
};

}  // namespace firn::bench
