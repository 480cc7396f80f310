// SPDX-License-Identifier: MIT
#include "src/app/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "src/app/interrupt.h"

namespace firn {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(200);  // on a terminal
constexpr auto kPlainLine = std::chrono::seconds(5);      // elsewhere
constexpr std::size_t kRecentFrames = 8;
constexpr const char* kDoing[] = {"simulating", "tracing", "writing"};

// Characters that fit into a line; a longer line would be wrapped by the terminal, and redrawn below itself.
std::size_t width() {
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return std::string::npos;
  return size.ws_col - 1u;
}

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

std::string clock_text(double seconds) {
  const long s = std::lround(std::max(seconds, 0.0));
  char text[32];
  if (s >= 3600) std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
  if (s < 3600) std::snprintf(text, sizeof text, "%ld:%02ld", s / 60, s % 60);
  return text;
}

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { frames_end(); }

void Progress::message(const std::string& line) {
  if (quiet_) return;
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, "%s%s\n", terminal_ ? "\r\033[K" : "", line.c_str());
}

// Until the session has begun a signal takes them along; then it is asked to stop.
void Progress::made_folders(const std::vector<std::filesystem::path>& folders) {
  if (folders.empty()) stop_of_signals();
  remove_when_interrupted(folders);
}

void Progress::frames_begin(int count, double seconds) {
  {
    const std::lock_guard lock(mutex_);
    frames_ = count;
    finished_ = 0;
    prior_ = seconds;
    started_ = last_finish_ = Clock::now();
    running_ = true;
  }
  if (quiet_) return;
  draw(false);
  ticker_ = std::thread([this] { tick(); });
}

void Progress::frames_end() {
  {
    const std::lock_guard lock(mutex_);
    if (!running_) return;
    running_ = false;
  }
  wake_.notify_all();
  if (ticker_.joinable()) ticker_.join();
  if (!quiet_ && terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::stage_begins(Stage stage, int frame) {
  const std::lock_guard lock(mutex_);
  frame_[static_cast<int>(stage)] = frame;
}

void Progress::stage_ends(Stage stage, int) {
  const std::lock_guard lock(mutex_);
  frame_[static_cast<int>(stage)] = -1;
  if (stage != Stage::write) return;
  ++finished_;
  const auto now = Clock::now();
  recent_.push_back(seconds(now - last_finish_));
  if (recent_.size() > kRecentFrames) recent_.pop_front();
  last_finish_ = now;
}

double Progress::seconds_left() const {
  // The first frame (it has nothing to simulate) says little about the next ones: the prior stays until the
  // second.
  const double mean =
      std::accumulate(recent_.begin(), recent_.end(), 0.0) / std::max<std::size_t>(recent_.size(), 1);
  const double waited = seconds(Clock::now() - last_finish_);
  const double frame = std::max(finished_ > 1 ? mean : std::max(prior_, mean), 0.0);
  return frame * (frames_ - finished_ - 1) + std::max(frame - waited, 0.0);
}

std::string Progress::line() const {
  char text[96];
  std::snprintf(text, sizeof text, "%3d %%  %d of %d frames", 100 * finished_ / std::max(frames_, 1),
                finished_, frames_);
  std::string line = text;
  for (int stage = 0; stage < 3; ++stage) {
    if (frame_[stage] >= 0) line += std::string(", ") + kDoing[stage] + " " + std::to_string(frame_[stage]);
  }
  line += "; " + clock_text(seconds(Clock::now() - started_)) + " gone, ";
  return line + (finished_ > 1 ? "" : "about ") + clock_text(seconds_left()) + " left";
}

void Progress::draw(bool periodic) {
  const std::lock_guard lock(mutex_);
  if (periodic && !terminal_ && Clock::now() - last_draw_ < kPlainLine) return;
  last_draw_ = Clock::now();
  std::fprintf(stderr, terminal_ ? "\r\033[K%s" : "%s\n", line().substr(0, width()).c_str());
  std::fflush(stderr);
}

void Progress::tick() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kRedraw, [this] { return !running_; })) {
    lock.unlock();
    draw(true);
    lock.lock();
  }
}

}  // namespace firn
