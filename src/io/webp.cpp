// SPDX-License-Identifier: MIT
// The animated WebP: every frame is encoded by itself and in parallel, then all are put together. Encoding
// differences between frames would save little (the whole film moves: noise and snow) and would be serial.
#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/io/file.h"
#include "src/io/images.h"
#include "src/io/movie.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

struct MuxDelete {
  void operator()(WebPMux* mux) const { WebPMuxDelete(mux); }
};

fs::path frame_path(const MovieJob& job, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.", frame);
  return job.frames / (name + job.extension);
}

std::string encode_webp(const Image8& image, const fs::path& where) {
  WebPConfig config;
  WebPPicture picture;
  WebPMemoryWriter writer;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  WebPMemoryWriterInit(&writer);
  config.quality = 88;
  config.method = 3;
  picture.width = image.width;
  picture.height = image.height;
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool encoded =
      WebPPictureImportRGB(&picture, image.rgb.data(), 3 * image.width) && WebPEncode(&config, &picture);
  const int error = picture.error_code;
  std::string bytes(reinterpret_cast<const char*>(writer.mem), encoded ? writer.size : 0);
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  if (!encoded)
    throw Error(ErrorCode::failed, where.string(),
                "libwebp cannot encode it, error " + std::to_string(error));
  return bytes;
}

void check(WebPMuxError error, const fs::path& movie) {
  if (error != WEBP_MUX_OK) {
    throw Error(ErrorCode::failed, movie.string(),
                "libwebp cannot put the movie together, error " + std::to_string(error));
  }
}

}  // namespace

fs::path make_webp(const MovieJob& job, const std::stop_token& stop) {
  fs::path movie = job.out.string() + ".webp";
  std::vector<std::string> encoded(static_cast<std::size_t>(job.last - job.first + 1));
  parallel_for(encoded.size(), 1, [&](std::size_t i) {
    if (stop.stop_requested()) return;
    const fs::path path = frame_path(job, job.first + static_cast<int>(i));
    encoded[i] = encode_webp(read_image8(path), path);
  });
  if (stop.stop_requested())
    throw Error(ErrorCode::interrupted, movie.string(), "interrupted before the movie was made");

  const std::unique_ptr<WebPMux, MuxDelete> mux(WebPMuxNew());
  const auto milliseconds = [&](std::size_t i) {
    return static_cast<int>(std::lround(1000.0 * i / job.fps));
  };
  for (std::size_t i = 0; i < encoded.size(); ++i) {
    WebPMuxFrameInfo frame{};
    frame.bitstream = {reinterpret_cast<const std::uint8_t*>(encoded[i].data()), encoded[i].size()};
    frame.duration = std::max(1, milliseconds(i + 1) - milliseconds(i));
    frame.id = WEBP_CHUNK_ANMF;
    frame.dispose_method = WEBP_MUX_DISPOSE_NONE;
    frame.blend_method = WEBP_MUX_NO_BLEND;
    check(WebPMuxPushFrame(mux.get(), &frame, 1), movie);
  }
  const WebPMuxAnimParams forever{0xff000000u, 0};
  check(WebPMuxSetAnimationParams(mux.get(), &forever), movie);
  WebPData assembled{};
  check(WebPMuxAssemble(mux.get(), &assembled), movie);
  const std::unique_ptr<WebPData, void (*)(WebPData*)> owned(&assembled,
                                                             [](WebPData* d) { WebPDataClear(d); });
  write_file(movie, {reinterpret_cast<const char*>(assembled.bytes), assembled.size});
  return movie;
}

}  // namespace firn
