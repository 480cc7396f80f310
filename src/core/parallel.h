// SPDX-License-Identifier: MIT
// The only door to parallel loops. Every body writes to places of its own, so results do not depend on the
// split; reductions that are not exact (sums) are done by the caller over per-chunk results in index order.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace firn {

// Runs body(i) for i in [0, count). `grain` is the least number of items that is worth a task. Isolated: a
// thread that waits for this loop never picks up an unrelated flow-graph node and so cannot deadlock or hold
// up a frame.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, Body&& body) {
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(grain, 1)),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
                      });
  });
}

// Runs body(chunk, begin, end) over fixed chunks of `size` items. The cut does not depend on the thread
// count, so sums over chunks in order give the same bits on any machine.
template <class Body>
void parallel_chunks(std::size_t count, std::size_t size, Body&& body) {
  const std::size_t chunks = (count + size - 1) / size;
  parallel_for(chunks, 1,
               [&](std::size_t chunk) { body(chunk, chunk * size, std::min(count, (chunk + 1) * size)); });
}

// Scratch memory that each thread keeps from one body of a loop to the next: made on first use. Results must
// not depend on what is left in it.
template <class Scratch>
class PerThread {
 public:
  Scratch& mine() { return all_.local(); }

 private:
  tbb::enumerable_thread_specific<Scratch> all_;
};

// Sorts [first, last). `less` must be a total order without ties: the sort is not stable, and only then is
// its result the same for any number of threads.
template <class Iterator, class Less>
void parallel_sort(Iterator first, Iterator last, Less&& less) {
  tbb::this_task_arena::isolate([&] { tbb::parallel_sort(first, last, less); });
}

}  // namespace firn
