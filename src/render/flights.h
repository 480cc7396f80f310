// SPDX-License-Identifier: MIT
// Where rays of light go: a stream of them flies until each meets the first of object, lamp, a collision in
// the snow or in another medium, or leaves the scene; or is asked how much of it comes through. The snow's
// surface is index-matched: it bends nothing and only ends the medium.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/trace/table.h"
#include "src/render/lights.h"
#include "src/render/media.h"
#include "src/render/objects.h"
#include "src/render/ray_stream.h"
#include "src/render/render_grid.h"
#include "src/render/snow_field.h"

namespace firn {

enum class Meets : std::uint8_t { nothing, light, object, snow, deep_snow, medium };

struct Arrival {
  Meets what = Meets::nothing;
  int medium = -1;
  Vec3f weight = Vec3f::Ones();  // throughput by density of the flight
  LightHit light;                // of `light` and of `nothing`
  ObjectHit object;
};

// All that a ray can meet; lives as long as the frame.
struct World {
  const kernels::TraceKernels& kernels;
  const ObjectSet& objects;
  const LightSet& lights;
  const MediumSet& media;
  const kernels::TraceGrid& grid;  // the snow's cells
  const kernels::MediumField& snow;
};

class Flights {
 public:
  explicit Flights(const World& world) : world_(world) {}

  // Ray i ends at arrivals[i], its t there; `keys` make its random numbers.
  void fly(RayStream& rays, const std::vector<std::uint64_t>& keys, std::vector<Arrival>& arrivals);

  // What comes through of each ray up to its reach: 0 or 1 by objects and the snow (there by chance: on
  // average it is the transmittance), times that of other media.
  void pass(RayStream& rays, const std::vector<std::uint64_t>& keys, std::vector<Vec3f>& through);

 private:
  const World& world_;
};

}  // namespace firn
