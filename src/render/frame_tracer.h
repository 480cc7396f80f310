// SPDX-License-Identifier: MIT
// Renders one snapshot into one picture: render grid -> tiles -> packets -> paths -> film -> picture.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stop_token>

#include "firn/picture.h"
#include "firn/snapshot.h"
#include "src/render/pilot.h"
#include "src/render/preview/preview_times.h"
#include "src/render/setup.h"
#include "src/render/sights.h"

namespace firn::kernels {
struct KernelTable;
}

namespace firn {

struct RenderStats {
  double build_seconds = 0;  // render grid and fields
  double field_seconds = 0;  // the latter
  double trace_seconds = 0;
  PreviewTimes preview;
  double mean_samples = 0;   // a pixel
  std::uint64_t rays = 0;    // primary + shadow + bounce
  std::uint64_t turns = 0;   // as in Work
  double pilot_seconds = 0;  // that the choice took; its rays are not among those above
  Choice choice;             // which integrator it is by
  // kg, of the first moment, where light scatters in the snow: all, and what the surface or the balls enclose
  // of it.
  double snow_mass = 0, medium_mass = 0;
  std::size_t grid_bytes = 0;
};

class FrameTracer {
 public:
  // Errors: usage Error for a setup that cannot be rendered (camera on its target, no pixels...).
  FrameTracer(const kernels::KernelTable& kernels, RenderSetup setup);
  ~FrameTracer();
  FrameTracer(FrameTracer&&) noexcept;

  const RenderSetup& setup() const;  // as it was given

  // Returns false if a stop was requested first (the picture is then incomplete). The same
  // snapshot, setup and frame number give the same bits for any thread count. An unstable Error if a position
  // is not finite.
  bool render(const Snapshot& snapshot, Picture& picture, RenderStats& stats,
              const std::stop_token& stop = {});

  // What a picture of the snapshot would show. Takes all the memory that render() would, in a small part of
  // its time: `picture` has its layers, but few of its pixels.
  Sights look(const Snapshot& snapshot, Picture& picture);

  // The same snow as render() was last given, which must still be there, from another camera: only for the
  // preview, and without the time that the grid takes.
  bool look_again(const Snapshot& snapshot, const Camera& camera, Picture& picture, RenderStats& stats,
                  const std::stop_token& stop = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace firn
