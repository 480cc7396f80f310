// SPDX-License-Identifier: MIT
// How far a run is, for people on stderr: one line that is redrawn on a terminal, plain lines every few
// seconds otherwise, by a thread of its own so that it also moves inside a long frame. The time left is known
// from the first second: before frames have been timed it comes from a prior (work counted by the caller).
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "firn/observer.h"

namespace firn {

class Progress : public Observer {
 public:
  explicit Progress(bool quiet);
  ~Progress() override;

  void message(const std::string& line) override;  // a line that stays
  void made_folders(const std::vector<std::filesystem::path>& folders) override;
  void frames_begin(int count, double seconds) override;
  void frames_end() override;
  void stage_begins(Stage stage, int frame) override;
  void stage_ends(Stage stage, int frame) override;

 private:
  using Clock = std::chrono::steady_clock;
  std::string line() const;
  double seconds_left() const;
  void draw(bool periodic);
  void tick();

  const bool quiet_;
  const bool terminal_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::thread ticker_;
  bool running_ = false;
  int frames_ = 0, finished_ = 0;
  double prior_ = 0;
  int frame_[3] = {-1, -1, -1};  // that each stage is at; -1: idle
  Clock::time_point started_, last_finish_, last_draw_;
  std::deque<double> recent_;  // s between the ends of the last frames
};

std::string clock_text(double seconds);  // "0:07", "1:02:03"

}  // namespace firn
