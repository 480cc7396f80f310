// SPDX-License-Identifier: MIT
// How much memory a run will take, found by doing what a run does: its first frame and the first steps after
// it, with all their memory and few of their rays. What is reckoned for a run is so always what it does.
#pragma once
#include "src/render/frame_tracer.h"
#include "src/scene/scene.h"

namespace firn {

class Solver;

struct Rehearsal {
  Sights sights;                       // of the first frame
  double at_start = 0;                 // bytes of the process while the first frame is made
  double peak_low = 0, peak_high = 0;  // bytes; the most that the process holds at once lies between them
};

// Steps the simulation. Errors: those of the simulation and the renderer.
Rehearsal rehearse(const SceneConfig& scene, Solver& simulation, FrameTracer& renderer);

}  // namespace firn
