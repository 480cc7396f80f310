// SPDX-License-Identifier: MIT
// The threads of one owner are as many as it asked for, whatever others in the process have.
#include "src/core/threads.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include "src/core/parallel.h"
#include "tests/catch.h"
#include "tests/threads.h"

using namespace firn;

namespace {

// On how many threads a loop with time for all of them runs.
std::size_t threads_of_a_loop() {
  std::mutex mutex;
  std::set<std::thread::id> seen;
  parallel_for(64, 1, [&](std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::lock_guard lock(mutex);
    seen.insert(std::this_thread::get_id());
  });
  return seen.size();
}

}  // namespace

TEST_CASE("A loop runs on the threads of its owner and no more") {
  const int count = GENERATE(1, 2, 3, 5);
  std::size_t seen = 0;
  test::with_threads(8, [&] { Threads(count).run([&] { seen = threads_of_a_loop(); }); });
  CHECK(seen <= static_cast<std::size_t>(count));
  CHECK((seen > 1) == (count > 1));
}

TEST_CASE("Owners at work at the same time keep to their own threads") {
  std::size_t one = 0, three = 0;
  test::with_threads(8, [&] {
    Threads single(1), several(3);
    std::thread other([&] { one = single.run(threads_of_a_loop); });
    three = several.run(threads_of_a_loop);
    other.join();
  });
  CHECK(one == 1);
  CHECK(three >= 1);
  CHECK(three <= 3);
}

TEST_CASE("Nothing asked for is all that the machine has") {
  const int all = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  CHECK(Threads::count_of(0) == all);
  CHECK(Threads::count_of(-3) == all);
  CHECK(Threads::count_of(7) == 7);
}
