// SPDX-License-Identifier: MIT
// One flow graph owns time: simulate(k+1), trace(k) and write(k-1) run together over circulating slots.
//
//   frames --> [join] --> simulate --> trace --> write --+
//                 ^                                       |
//                 +---------------- free slots <----------+
//
// The message is {frame, slot}, never data; the slots bound memory and the slowest stage throttles the rest.
#pragma once
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "firn/observer.h"
#include "firn/picture.h"
#include "firn/snapshot.h"

namespace firn {

inline constexpr int kSlots = 3;  // one frame simulated, one traced, one written

struct FrameSlot {
  Snapshot snapshot;
  Picture picture;
};

struct FrameStages {
  // Each gets the frame number and the frame's slot. Returning false stops the run (interrupted); throwing
  // ends it as an error. Every stage runs for one frame at a time and in frame order.
  // simulate and trace are to return false soon after a stop is requested of them.
  std::function<bool(int, FrameSlot&, const std::stop_token&)> simulate;
  std::function<bool(int, FrameSlot&, const std::stop_token&)> trace;
  std::function<bool(int, FrameSlot&)> write;
  // Asked just before a frame is simulated; false passes the frame over: somebody else makes it. May be
  // empty.
  std::function<bool(int)> claim = {};
};

struct FrameGraphOptions {
  std::vector<int> frames;  // ascending
  int slots = kSlots;       // 1: no overlap
};

std::vector<int> frame_range(int first, int last);  // both included

struct FrameGraphResult {
  int finished = 0;  // frames whose write returned true
  bool interrupted = false;
  std::vector<StageInterval> intervals;  // in order of their ends
  std::vector<Snapshot> pending;  // simulated but not written when the run was interrupted, in frame order
};

// Runs the stages over the frames, on the caller's threads (core/threads.h). A stop may be requested from
// outside: the stages are asked to stop too and no new frame is begun. A stage that fails on frame k ends the
// run there: frames before k are still finished, frames after k are dropped, and the first exception is
// rethrown once every running stage has ended. A failing trace or write also stops the simulation, since
// nothing that is still simulated could be shown.
FrameGraphResult run_frames(const FrameStages& stages, const FrameGraphOptions& options,
                            const std::stop_token& stop = {});

}  // namespace firn
