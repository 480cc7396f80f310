// SPDX-License-Identifier: MIT
// A scene run as the program `firn` runs it, with its progress, cancelled in the middle and gone on with:
//   session SCENE RUN_FOLDER [THREADS]
#include <firn/firn.h>

#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stop_token>

namespace {

// Stages of several frames run at the same time, and so do these calls.
class Progress : public firn::Observer {
 public:
  explicit Progress(int frames) : frames_(frames) {}

  void message(const std::string& line) override { std::printf("%s\n", line.c_str()); }

  void stage_ends(firn::Stage stage, int frame) override {
    const std::lock_guard lock(mutex_);
    if (stage == firn::Stage::trace) std::printf("traced frame %d\n", frame);
    if (stage == firn::Stage::write && ++written_ == frames_ / 2) half_.request_stop();
  }

  std::stop_token half() const { return half_.get_token(); }

 private:
  const int frames_;
  std::mutex mutex_;
  int written_ = 0;
  std::stop_source half_;
};

}  // namespace

int main(int count, char** words) try {
  if (count < 3) return std::fprintf(stderr, "usage: session SCENE RUN_FOLDER [THREADS]\n"), 2;
  const firn::Scene scene = firn::Scene::read(words[1], {.quick = true});
  firn::SessionOptions options;
  options.out = words[2];
  options.threads = count > 3 ? std::atoi(words[3]) : 0;
  options.overwrite = true;

  Progress progress(scene.frames());
  firn::SessionResult result = firn::Session::start(scene, options, progress).run(progress.half());
  if (result.interrupted) {
    std::printf("stopped: %d frames are kept, %zu are left\n", result.kept, result.left.size());
    options.overwrite = false;
    result = firn::Session::resume(words[2], options, progress).run();
  }
  std::printf("%s\n", result.interrupted ? "interrupted" : "complete");
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
