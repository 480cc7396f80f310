// SPDX-License-Identifier: MIT
// The laws of the frame graph, read from the intervals that it records: order, overlap, bounded slots, clean
// ends. Stage bodies only record (Catch2 2's assertions are not thread-safe); everything is asserted
// afterwards.
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <string_view>
#include <thread>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/graph/frame_graph.h"
#include "tests/catch.h"
#include "tests/threads.h"

using namespace firn;

namespace {

using Stop = std::stop_token;

bool rest(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
  return true;
}

FrameStages sleeping_stages(int simulate, int trace, int write) {
  return {[=](int, FrameSlot&, const Stop&) { return rest(simulate); },
          [=](int, FrameSlot&, const Stop&) { return rest(trace); },
          [=](int, FrameSlot&) { return rest(write); }};
}

FrameGraphResult run(const FrameStages& stages, int threads, const FrameGraphOptions& options,
                     const Stop& stop = {}) {
  return test::with_threads(threads, [&] { return run_frames(stages, options, stop); });
}

StageInterval find(const FrameGraphResult& result, std::string_view stage, int frame) {
  for (const auto& i : result.intervals) {
    if (stage == i.stage && frame == i.frame) return i;
  }
  throw std::runtime_error("no such interval");
}

bool overlap(const StageInterval& a, const StageInterval& b) { return a.begin < b.end && b.begin < a.end; }

}  // namespace

TEST_CASE("With two or more slots, frame k+1 is simulated while frame k is traced, for every k") {
  const int slots = GENERATE(2, 3);
  // The two meet: each waits (for a while) until the other has begun. On one slot neither could.
  std::atomic<int> simulating{-1}, tracing{-1};
  const auto wait_for = [](const std::atomic<int>& begun, int frame) {
    for (int ms = 0; ms < 2000 && begun < frame; ++ms) rest(1);
    return true;
  };
  FrameStages stages = sleeping_stages(0, 0, 1);
  stages.simulate = [&](int f, FrameSlot&, const Stop&) { return simulating = f, wait_for(tracing, f - 1); };
  stages.trace = [&](int f, FrameSlot&, const Stop&) {
    return tracing = f, f == 7 || wait_for(simulating, f + 1);
  };
  const auto result = run(stages, 4, {frame_range(0, 7), slots});
  REQUIRE(result.finished == 8);
  for (int k = 0; k < 7; ++k) {
    INFO("slots " << slots << ", frame " << k);
    CHECK(overlap(find(result, "trace", k), find(result, "simulate", k + 1)));
  }
}

TEST_CASE("With one slot nothing overlaps") {
  const auto result = run(sleeping_stages(3, 3, 3), 4, {frame_range(0, 5), 1});
  REQUIRE(result.intervals.size() == 18);
  for (std::size_t i = 0; i < 18; ++i) {
    for (std::size_t j = i + 1; j < 18; ++j) CHECK_FALSE(overlap(result.intervals[i], result.intervals[j]));
  }
}

TEST_CASE("Every stage takes the frames one at a time and in order, also when early frames are slow") {
  std::vector<int> seen[3];
  FrameStages stages;
  stages.simulate = [&](int f, FrameSlot&, const Stop&) {
    return seen[0].push_back(f), rest(f % 3 == 0 ? 6 : 0);
  };
  stages.trace = [&](int f, FrameSlot&, const Stop&) {
    return seen[1].push_back(f), rest(f % 4 == 0 ? 8 : 1);
  };
  stages.write = [&](int f, FrameSlot&) { return seen[2].push_back(f), rest(f % 2); };
  run(stages, 4, {frame_range(3, 22), 4});
  std::vector<int> expected;
  for (int f = 3; f <= 22; ++f) expected.push_back(f);
  for (const auto& order : seen) CHECK(order == expected);
}

TEST_CASE("A frame keeps its slot through all stages and no slot serves two frames at once") {
  std::mutex mutex;
  std::set<FrameSlot*> all, busy;
  bool shared = false, moved = false;
  FrameStages stages;
  stages.simulate = [&](int f, FrameSlot& slot, const Stop&) {
    const std::lock_guard lock(mutex);
    all.insert(&slot);
    shared |= !busy.insert(&slot).second;
    slot.snapshot.time = f;
    return rest(1);
  };
  stages.trace = [&](int f, FrameSlot& slot, const Stop&) {
    return moved |= slot.snapshot.time != f, rest(3);
  };
  stages.write = [&](int f, FrameSlot& slot) {
    const std::lock_guard lock(mutex);
    moved |= slot.snapshot.time != f || slot.snapshot.frame != f;
    busy.erase(&slot);
    return true;
  };
  run(stages, 4, {frame_range(0, 30), 3});
  CHECK(all.size() <= 3);
  CHECK_FALSE(shared);
  CHECK_FALSE(moved);
}

TEST_CASE("One thread is enough, with nested parallel loops in every stage") {
  const int slots = GENERATE(1, 2, 3);
  const int threads = GENERATE(1, 2);
  std::atomic<int> items{0};
  const auto loop = [&](int, FrameSlot&, const auto&...) {
    parallel_for(100, 1, [&](std::size_t) { ++items; });
    return true;
  };
  CHECK(run({loop, loop, loop}, threads, {frame_range(0, 9), slots}).finished == 10);
  CHECK(items == 3000);
}

TEST_CASE("An exception of the simulation comes out after all earlier frames are written") {
  std::vector<int> written;
  FrameStages stages = sleeping_stages(1, 10, 1);
  stages.simulate = [](int f, FrameSlot&, const Stop&) {
    if (f == 4) throw Error(ErrorCode::unstable, "", "blew up");
    return true;
  };
  stages.write = [&](int f, FrameSlot&) { return written.push_back(f), true; };
  std::stop_source stop;
  try {
    run(stages, 2, {frame_range(0, 20), 3}, stop.get_token());
    FAIL("no exception");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::unstable);
  }
  CHECK(written == std::vector<int>{0, 1, 2, 3});
}

TEST_CASE("An exception of a later stage stops the simulation and comes out") {
  const bool in_write = GENERATE(false, true);
  std::atomic<int> last{0};
  FrameStages stages = sleeping_stages(1, 1, 1);
  stages.simulate = [&](int f, FrameSlot&, const Stop& stop) {
    last = f;
    while (f == 3 && !stop.stop_requested()) rest(1);  // else it would last for ever
    return !stop.stop_requested();
  };
  const auto fail = [](int f) {
    if (f == 2) throw std::runtime_error("disk full");
    return true;
  };
  if (in_write) stages.write = [&](int f, FrameSlot&) { return fail(f); };
  if (!in_write) stages.trace = [&](int f, FrameSlot&, const Stop&) { return fail(f); };
  std::stop_source stop;
  CHECK_THROWS_WITH(run(stages, 2, {frame_range(0, 1000), 3}, stop.get_token()), "disk full");
  CHECK_FALSE(stop.stop_requested());  // nobody else is stopped
  CHECK(last <= 3);
}

TEST_CASE("A stopped run finishes what was traced and hands back what was simulated but not written") {
  std::stop_source stop;
  std::vector<int> written;
  FrameStages stages;
  stages.simulate = [&](int f, FrameSlot&, const Stop&) {
    rest(2);
    if (f == 6) {
      while (!stop.stop_requested()) rest(1);
      return false;
    }
    return true;
  };
  stages.trace = [&](int f, FrameSlot&, const Stop&) {
    if (f == 4) stop.request_stop();
    return !stop.stop_requested();
  };
  stages.write = [&](int f, FrameSlot&) { return written.push_back(f), true; };
  const auto result = run(stages, 4, {frame_range(0, 50), 3}, stop.get_token());
  CHECK(result.interrupted);
  CHECK(result.finished == 4);
  CHECK(written == std::vector<int>{0, 1, 2, 3});
  REQUIRE(!result.pending.empty());
  for (std::size_t i = 0; i < result.pending.size(); ++i)
    CHECK(result.pending[i].frame == 4 + static_cast<int>(i));
}

TEST_CASE(
    "Stopped in any stage of any frame, a run hands back each simulated frame that is not written, once") {
  const int frames = GENERATE(1, 2, 3, 4, 5), slots = GENERATE(1, 2, 3), first = GENERATE(0, 7);
  for (int at = first; at < first + frames; ++at) {
    for (int stage = 0; stage < 3; ++stage) {
      std::stop_source stop;
      std::atomic<int> simulated{first - 1}, written{first - 1};
      const auto reaches = [&](int s, int frame) {
        if (s == stage && frame == at) stop.request_stop();
      };
      FrameStages stages;
      stages.simulate = [&](int frame, FrameSlot& slot, const Stop&) {
        slot.snapshot.time = 100 + frame;
        reaches(0, frame);
        if (stop.stop_requested()) return false;
        simulated = frame;
        return true;
      };
      stages.trace = [&](int frame, FrameSlot&, const Stop&) {
        return reaches(1, frame), !stop.stop_requested();
      };
      stages.write = [&](int frame, FrameSlot&) { return reaches(2, frame), written = frame, true; };
      const auto result = run(stages, 2, {frame_range(first, first + frames - 1), slots}, stop.get_token());
      INFO("frames " << first << "-" << first + frames - 1 << ", slots " << slots << ", stage " << stage
                     << " of frame " << at);
      CHECK(result.finished == written - first + 1);
      CHECK(result.interrupted == (written < first + frames - 1));
      REQUIRE(result.pending.size() == static_cast<std::size_t>(simulated - written));
      for (std::size_t i = 0; i < result.pending.size(); ++i) {
        const int frame = written + 1 + static_cast<int>(i);
        CHECK(result.pending[i].frame == frame);
        CHECK(result.pending[i].time == 100 + frame);
      }
    }
  }
}

TEST_CASE("A run that was stopped before it began does nothing and says so") {
  std::stop_source stop;
  stop.request_stop();
  const auto result = run(sleeping_stages(1, 1, 1), 2, {frame_range(0, 3), 2}, stop.get_token());
  CHECK(result.finished == 0);
  CHECK(result.interrupted);
  CHECK(result.intervals.empty());
}

TEST_CASE(
    "Frames with gaps are made in order, and those that others claim are passed over with their slots") {
  const int slots = GENERATE(1, 2, 3), threads = GENERATE(1, 4);
  std::vector<int> simulated, written;
  FrameStages stages = sleeping_stages(0, 1, 0);
  stages.claim = [](int frame) { return frame % 3 != 0; };
  stages.simulate = [&](int frame, FrameSlot&, const Stop&) { return simulated.push_back(frame), true; };
  stages.write = [&](int frame, FrameSlot& slot) {
    return written.push_back(frame), slot.snapshot.frame == frame;
  };
  const auto result = run(stages, threads, {{0, 3, 4, 6, 8, 9, 11, 12}, slots});
  CHECK(result.finished == 3);
  CHECK_FALSE(result.interrupted);
  CHECK(simulated == std::vector<int>{4, 8, 11});
  CHECK(written == simulated);
}

TEST_CASE("Frames that were passed over are not handed back when the run is stopped") {
  std::stop_source stop;
  FrameStages stages = sleeping_stages(0, 0, 0);
  stages.claim = [](int frame) { return frame % 2 == 1; };
  stages.trace = [&](int frame, FrameSlot&, const Stop&) {
    if (frame == 3) stop.request_stop();
    return !stop.stop_requested();
  };
  const auto result = run(stages, 2, {frame_range(0, 9), 3}, stop.get_token());
  CHECK(result.interrupted);
  CHECK(result.finished == 1);
  REQUIRE(!result.pending.empty());
  for (const Snapshot& snow : result.pending) CHECK(snow.frame % 2 == 1);
}
