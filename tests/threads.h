// SPDX-License-Identifier: MIT
// As many threads as a test asks for, however many the machine has.
#pragma once
#include <tbb/global_control.h>

#include <cstddef>
#include <utility>

#include "src/core/threads.h"

namespace firn::test {

template <class F>
auto with_threads(int threads, F&& f) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  return Threads(threads).run(std::forward<F>(f));
}

}  // namespace firn::test
