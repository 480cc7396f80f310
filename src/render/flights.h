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

// snow, deep_snow: a collision inside; snow_surface: where snow that only has a surface begins.
enum class Meets : std::uint8_t { nothing, light, object, snow, deep_snow, snow_surface, medium };

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
  const RenderGrid& grid;
  const SnowField& field;
  const kernels::MediumField& snow;  // what of it scatters
  const ImageSettings& image;
};

class Flights {
 public:
  explicit Flights(const World& world)
      : world_(world), inside_(world.image.snow_light == SnowLight::inside) {}

  // Ray i ends at arrivals[i], its t there; `keys` make its random numbers.
  // rays.hit: of a surface of snow, its ball or kSurfaceHit. `first`: camera rays, which the kernels like for
  // their neighbourhood.
  void fly(RayStream& rays, const std::vector<std::uint64_t>& keys, bool first,
           std::vector<Arrival>& arrivals);

  // The snow's surface before the rays' reach, as rays.hit and t.
  void find_surface(RayStream& rays, bool first) const;

  // Whether it lies there: rays.hit is 0 or kNoHit.
  void find_shadow(RayStream& rays) const;

  // What comes through of each ray up to its reach: 0 or 1 by objects and the snow (there by chance: on
  // average it is the transmittance), times that of other media.
  void pass(RayStream& rays, const std::vector<std::uint64_t>& keys, std::vector<Vec3f>& through);

 private:
  const World& world_;
  bool inside_;  // light scatters in the snow
};

}  // namespace firn
