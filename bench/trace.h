// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct TraceOptions {
  std::size_t particles = 1000000;
  std::string shape = "ball";    // bench/trace_scene.h
  std::string order = "blocks";  // of the particles
  double radius = 0.6;           // of a ball, in lattice spacings
  int threads = 2;
  std::string isa = "auto";
  int repeats = 9;
  bool rivals = true;
  std::string clock = "wall";  // or "cpu": bench/trace_frame.h
  std::string json;            // path; empty: none
};

// Times frames of firn's tracer and, where they were compiled, of its rivals, and prints figures and ratios.
// False if the tracers disagree about what the camera sees. Errors: usage, io, failed.
bool run_trace(const TraceOptions& options);

}  // namespace firn::bench
