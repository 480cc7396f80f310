// SPDX-License-Identifier: MIT
// A new run of a scene: everything is validated and the folder taken before the run begins, so that a mistake
// leaves nothing behind.
#pragma once
#include "src/app/options.h"
#include "src/app/production.h"

namespace firn {

struct RunKind {
  bool pictures = true;
  bool particles = false;  // kept whatever the scene says
  bool movie = true;
  std::optional<std::pair<int, int>> frames;  // used when --frames is absent; empty: all
};

ExitCode run_scene(const Options& options, const RunKind& kind);

// Shared with resume: the simulation of a scene on `kernels`, and the renderer of its pictures.
std::unique_ptr<SimulatedSnow> make_snow(const SceneConfig& scene, const kernels::KernelTable& kernels,
                                         bool force);
std::unique_ptr<Renderer> make_renderer(const SceneConfig& scene, const kernels::KernelTable& kernels);

// The --isa with which a run goes on. Errors: usage Error if its bits would be others.
std::string isa_of(const Options& options, const Manifest& manifest);
// Says so if another build of firn goes on with a run.
void tell_of_other_build(Production& run);

// Errors: usage Error for pictures that are too large for the movie that can be made here.
void require_movie(const SceneConfig& scene);

// A first guess of one frame's time, s: work counted from the scene and usual rates of one thread. Only shown
// until two frames have been timed.
double expected_frame_seconds(const SceneConfig& scene, const SimulatedSnow* snow, bool pictures,
                              int threads);

}  // namespace firn
