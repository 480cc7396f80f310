// SPDX-License-Identifier: MIT
// Frame numbers and free slots flow in, finished frames flow out. The stages never see one another: a frame
// that failed or was stopped travels on as an empty message, so that its slot comes back and the graph always
// drains by itself. Cancelling the graph instead would drop frames that were already simulated and lose their
// slots.
#include "src/graph/frame_graph.h"

#include <tbb/flow_graph.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <exception>
#include <mutex>
#include <numeric>
#include <string_view>
#include <tuple>
#include <utility>

namespace firn {
namespace {

using Clock = std::chrono::steady_clock;

struct Turn {
  std::size_t number;  // from 0, without gaps
  int frame;
};
using Ticket = std::tuple<Turn, int>;  // {turn, slot}

// Everything that the nodes share. The stages are serial, so only the log and the outcome need a lock.
class Run {
 public:
  Run(const FrameGraphOptions& options, const std::stop_token& stop)
      : slots(static_cast<std::size_t>(std::max(options.slots, 1))),
        holds_(slots.size(), kNoFrame),
        outside_(stop, [this] { stop_.request_stop(); }) {}

  bool wants(int frame) const { return frame < end_.load() && !stop_.stop_requested(); }

  // One stage on one frame, unless the run ended before it or the frame was passed over. True if the stage
  // was completed.
  template <class Stage>
  bool perform(const char* name, const Stage& stage, int frame, int slot) {
    if (frame >= end_.load() || holds_[static_cast<std::size_t>(slot)] != frame) return false;
    const double begin = seconds();
    bool done = false;
    try {
      done = stage(frame, slots[static_cast<std::size_t>(slot)]);
      if (!done) end_at(frame, nullptr);
    } catch (...) {
      end_at(frame, std::current_exception());
      if (std::string_view(name) != "simulate") stop_.request_stop();
    }
    const std::lock_guard lock(mutex_);
    result_.intervals.push_back(
        {name, frame, begin, seconds(), tbb::this_task_arena::current_thread_index()});
    return done;
  }

  // `simulated`, `written`: the last frames that these stages completed, -1 if none.
  FrameGraphResult finish(int finished, bool interrupted, int simulated, int written) {
    if (error_) std::rethrow_exception(error_);
    result_.finished = finished;
    result_.interrupted = interrupted;
    for (std::size_t slot = 0; slot < slots.size(); ++slot) {
      const int frame = holds_[slot];
      if (frame > written && frame <= simulated) result_.pending.push_back(std::move(slots[slot].snapshot));
    }
    std::sort(result_.pending.begin(), result_.pending.end(),
              [](const Snapshot& a, const Snapshot& b) { return a.frame < b.frame; });
    return std::move(result_);
  }

  // From here on a slot is of this frame, which its snapshot says too. A slot that was never used is of none.
  void assign(int slot, int frame) {
    slots[static_cast<std::size_t>(slot)].snapshot.frame = frame;
    holds_[static_cast<std::size_t>(slot)] = frame;
  }

  void pass_over(int slot) { holds_[static_cast<std::size_t>(slot)] = kNoFrame; }

  // simulate and trace, with what stops them.
  template <class Stage>
  bool perform_until_stopped(const char* name, const Stage& stage, int frame, int slot) {
    const auto stoppable = [&](int f, FrameSlot& s) { return stage(f, s, stop_.get_token()); };
    return perform(name, stoppable, frame, slot);
  }

  std::vector<FrameSlot> slots;

 private:
  static constexpr int kNoFrame = -1;
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void end_at(int frame, std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    end_.store(std::min(end_.load(), frame));
    if (!error_) error_ = std::move(error);
  }

  const Clock::time_point start_ = Clock::now();
  std::vector<int> holds_;  // the frame of each slot
  std::stop_source stop_;   // of this run: asked from outside, or because a stage failed
  std::stop_callback<std::function<void()>> outside_;
  std::atomic<int> end_{INT_MAX};  // the first frame that will not be finished
  std::mutex mutex_;
  FrameGraphResult result_;
  std::exception_ptr error_;
};

}  // namespace

std::vector<int> frame_range(int first, int last) {
  std::vector<int> frames(static_cast<std::size_t>(std::max(last - first + 1, 0)));
  std::iota(frames.begin(), frames.end(), first);
  return frames;
}

FrameGraphResult run_frames(const FrameStages& stages, const FrameGraphOptions& options,
                            const std::stop_token& stop) {
  namespace flow = tbb::flow;
  Run run(options, stop);
  std::size_t next = 0;  // these four have one serial writer each
  int simulated = -1, written = -1, passed_over = 0, finished = 0;

  flow::graph graph;
  flow::input_node<Turn> frames(graph, [&](tbb::flow_control& control) {
    if (next < options.frames.size() && run.wants(options.frames[next])) {
      const Turn turn{next, options.frames[next]};
      ++next;
      return turn;
    }
    control.stop();
    return Turn{};
  });
  flow::buffer_node<int> free_slots(graph);
  flow::join_node<Ticket, flow::reserving> pair(graph);
  flow::function_node<Ticket, Ticket> simulate(graph, flow::serial, [&](const Ticket& ticket) {
    const auto [turn, slot] = ticket;
    run.assign(slot, turn.frame);
    if (run.wants(turn.frame) && stages.claim && !stages.claim(turn.frame)) {
      run.pass_over(slot);
      ++passed_over;
    } else if (run.perform_until_stopped("simulate", stages.simulate, turn.frame, slot)) {
      simulated = turn.frame;
    }
    return ticket;
  });
  flow::function_node<Ticket, Ticket> trace(graph, flow::serial, [&](const Ticket& ticket) {
    run.perform_until_stopped("trace", stages.trace, std::get<0>(ticket).frame, std::get<1>(ticket));
    return ticket;
  });
  flow::function_node<Ticket, int> write(graph, flow::serial, [&](const Ticket& ticket) {
    const auto [turn, slot] = ticket;
    if (run.perform("write", stages.write, turn.frame, slot)) {
      written = turn.frame;
      ++finished;
    }
    return slot;
  });
  flow::make_edge(frames, flow::input_port<0>(pair));
  flow::make_edge(free_slots, flow::input_port<1>(pair));
  // A serial node runs one body at a time but starts its next body before it passes the last result on, so
  // the order between nodes is not kept by itself: a sequencer stands before each stage.
  const auto number = [](const Ticket& ticket) { return std::get<0>(ticket).number; };
  flow::sequencer_node<Ticket> to_simulate(graph, number), to_trace(graph, number), to_write(graph, number);
  flow::make_edge(pair, to_simulate);
  flow::make_edge(to_simulate, simulate);
  flow::make_edge(simulate, to_trace);
  flow::make_edge(to_trace, trace);
  flow::make_edge(trace, to_write);
  flow::make_edge(to_write, write);
  flow::make_edge(write, free_slots);

  for (int slot = 0; slot < static_cast<int>(run.slots.size()); ++slot) free_slots.try_put(slot);
  frames.activate();
  graph.wait_for_all();
  return run.finish(finished, passed_over + finished < static_cast<int>(options.frames.size()), simulated,
                    written);
}

}  // namespace firn
