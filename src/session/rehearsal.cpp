// SPDX-License-Identifier: MIT
#include "src/session/rehearsal.h"

#include <vector>

#include "src/core/memory.h"
#include "src/graph/frame_graph.h"
#include "src/io/images.h"
#include "src/io/particle_file.h"
#include "src/mpm/solver.h"
#include "src/session/snow_source.h"

namespace firn {
namespace {

constexpr int kSteps = 2;  // the second has particles that the first has moved
// Times the memory of the rehearsal: what whole runs take at most, since snow that spreads needs more of the
// grid, and the makers of frames meet at their worst. docs/performance.md has what ten scenes took.
constexpr double kMost = 1.59;

}  // namespace

Rehearsal rehearse(const SceneConfig& scene, Solver& simulation, FrameTracer& renderer) {
  Rehearsal rehearsal;
  FrameSlot first;
  simulation.snapshot(first.snapshot);
  rehearsal.sights = renderer.look(first.snapshot, first.picture);
  const ToneMapping tone{scene.output.exposure, scene.output.tone_map};
  for (const std::string& format : scene.output.formats) encode_picture(first.picture, format, tone);
  encode_snapshot(first.snapshot);
  rehearsal.at_start = static_cast<double>(peak_memory());

  rehearsal.peak_low = rehearsal.at_start;
  if (scene.time.frames > 1) {
    const std::vector<FrameSlot> others(kSlots - 1, first);
    for (int step = 0; step < kSteps; ++step) simulation.step(simulation.stable_step().dt);
    rehearsal.peak_low = static_cast<double>(peak_memory());
    if (scene.output.checkpoint_every > 0)
      rehearsal.peak_low += static_cast<double>(kSavedBytes * simulation.particle_count());
  }
  rehearsal.peak_high = kMost * rehearsal.peak_low;
  return rehearsal;
}

}  // namespace firn
