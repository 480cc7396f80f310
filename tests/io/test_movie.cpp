// SPDX-License-Identifier: MIT
// Movies: the WebP decodes to the frames at their times; the ffmpeg command is what a shell would run.
#include <webp/demux.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stop_token>
#include <thread>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/images.h"
#include "src/io/movie.h"
#include "src/io/program.h"
#include "tests/catch.h"
#include "tests/io/scratch.h"

using namespace firn;

namespace {

// A smooth picture with a disc that moves from frame to frame.
Image8 moving_disc(int frame) {
  Image8 image{64, 48, std::vector<std::uint8_t>(64 * 48 * 3)};
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool inside = std::hypot(x - 12.0 - 10 * frame, y - 24.0) < 9;
      std::uint8_t* pixel = &image.rgb[3 * (static_cast<std::size_t>(y) * 64 + x)];
      pixel[0] = pixel[1] = pixel[2] = static_cast<std::uint8_t>(inside ? 230 : 40 + y);
    }
  }
  return image;
}

MovieJob write_frames(const Scratch& scratch, int first, int last) {
  for (int frame = first; frame <= last; ++frame) {
    write_file(scratch / ("000" + std::to_string(frame) + ".png"), encode_png(moving_disc(frame - first)));
  }
  return {scratch.path(), "png", first, last, 24, scratch / "movie"};
}

double mean_difference(const std::uint8_t* rgba, const Image8& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.rgb.size(); ++i) sum += std::abs(rgba[i / 3 * 4 + i % 3] - image.rgb[i]);
  return sum / static_cast<double>(image.rgb.size());
}

// A shell script of this text is the only `ffmpeg` on the PATH while it lives.
class FakeFfmpeg {
 public:
  FakeFfmpeg(const Scratch& scratch, const std::string& text) {
    write_file(scratch / "ffmpeg", "#!/bin/sh\n" + text);
    std::filesystem::permissions(scratch / "ffmpeg", std::filesystem::perms::owner_all);
    ::setenv("PATH", (scratch.path().string() + ":" + old_).c_str(), 1);
  }
  ~FakeFfmpeg() { ::setenv("PATH", old_.c_str(), 1); }

 private:
  const std::string old_ = std::getenv("PATH");
};

}  // namespace

TEST_CASE("The animated WebP decodes to the frames, in order and at their times") {
  Scratch scratch;
  const MovieJob job = write_frames(scratch, 2, 6);
  const std::string bytes = read_file(make_webp(job));
  const WebPData webp{reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
  WebPAnimDecoder* decoder = WebPAnimDecoderNew(&webp, nullptr);
  REQUIRE(decoder != nullptr);
  WebPAnimInfo about;
  WebPAnimDecoderGetInfo(decoder, &about);
  CHECK(about.frame_count == 5);
  CHECK(about.canvas_width == 64);
  CHECK(about.loop_count == 0);
  for (int frame = 0; frame < 5; ++frame) {
    std::uint8_t* pixels = nullptr;
    int end = 0;
    REQUIRE(WebPAnimDecoderGetNext(decoder, &pixels, &end));
    CHECK(end == std::lround(1000.0 * (frame + 1) / 24));
    CHECK(mean_difference(pixels, moving_disc(frame)) < 4);
    if (frame > 0) CHECK(mean_difference(pixels, moving_disc(frame - 1)) > 8);
  }
  WebPAnimDecoderDelete(decoder);
}

TEST_CASE("A missing frame is an error that names it, and no movie appears") {
  Scratch scratch;
  MovieJob job = write_frames(scratch, 0, 2);
  job.last = 3;
  CHECK_THROWS_WITH(make_webp(job), contains("0003.png"));
  CHECK_FALSE(std::filesystem::exists(scratch / "movie.webp"));
}

TEST_CASE("The ffmpeg command starts at the first frame, and its line is safe to paste into a shell") {
  const MovieJob job{"/out/it's here/frames", "png", 12, 24, 12.5, "/out/it's here/movie"};
  const auto words = ffmpeg_command(job);
  const auto after = [&](const std::string& word) {
    return *(std::find(words.begin(), words.end(), word) + 1);
  };
  CHECK(words[0] == "ffmpeg");
  CHECK(after("-framerate") == "12.5");
  CHECK(after("-start_number") == "12");
  CHECK(after("-frames:v") == "13");
  CHECK(after("-i") == "/out/it's here/frames/%04d.png");
  CHECK_THAT(shell_line(words), contains("-i '/out/it'\\''s here/frames/%04d.png'"));
  // Names that ffmpeg would take for a protocol, an option or a pattern.
  const auto odd = ffmpeg_command({"-x/r12:30/50%d/frames", "png", 0, 1, 24, "-x/movie"});
  CHECK_THAT(*(std::find(odd.begin(), odd.end(), "-i") + 1), contains("/-x/r12:30/50%%d/frames/%04d.png"));
  CHECK(odd.back() == std::filesystem::absolute("-x/movie").string() + ".mp4");
}

TEST_CASE(
    "A failing ffmpeg is an error with the last thing it said, without control characters, and leaves no "
    "file") {
  Scratch scratch;
  const FakeFfmpeg fake(scratch, "echo first >&2\nprintf 'no \\033[31msuch\\007 codec\\n' >&2\nexit 1\n");
  CHECK(find_program("ffmpeg") == scratch / "ffmpeg");
  CHECK_THROWS_WITH(make_mp4(write_frames(scratch, 0, 1)),
                    contains("movie.mp4") && contains("no [31msuch codec"));
  CHECK_FALSE(std::filesystem::exists(scratch / "movie.mp4"));
}

TEST_CASE(
    "An ffmpeg that is at work when the run is interrupted is ended at once, deaf or not, and leaves no "
    "file") {
  const std::string trap = GENERATE("", "trap '' TERM\n");
  Scratch scratch;
  const FakeFfmpeg fake(scratch, trap + "for word; do last=$word; done\necho half >\"$last\"\nsleep 30\n");
  std::stop_source stop;
  std::thread interrupt([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    stop.request_stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  try {
    make_mp4(write_frames(scratch, 0, 1), stop.get_token());
    FAIL_CHECK("a movie was made");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::interrupted);
  }
  interrupt.join();
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(15));
  CHECK_FALSE(std::filesystem::exists(scratch / "movie.mp4"));
  CHECK_FALSE(std::filesystem::exists(scratch / "movie.part.mp4"));
}
