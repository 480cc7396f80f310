// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct PreviewOptions {
  std::size_t particles = 1000000;
  std::string shape = "ball";  // bench/trace_scene.h
  int threads = 2;
  std::string isa = "auto";
  int repeats = 9;
  std::string clock = "wall";  // or "cpu": bench/trace_frame.h; of whole frames, stages have the wall's
  std::string json;            // path; empty: none
};

// Times frames of the preview at 960 x 540: of snow that stands still before a camera that moves, and of snow
// that moves. Errors: usage, io.
void run_preview(const PreviewOptions& options);

}  // namespace firn::bench
