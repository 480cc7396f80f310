// SPDX-License-Identifier: MIT
// Where rays of light go: a stream of them flies until each meets the first of object, lamp, a collision in
// the snow or in another medium, or leaves the scene; or is asked how much of it comes through. The snow's
// surface is index-matched: it bends nothing and only ends the medium.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/trace/table.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/lights/lights.h"
#include "src/render/snow/render_grid.h"
#include "src/render/snow/snow_field.h"
#include "src/render/solids/media.h"
#include "src/render/solids/objects.h"

namespace firn {

// snow: a collision inside; snow_surface: where snow that only has a surface begins.
enum class Meets : std::uint8_t { nothing, light, object, snow, snow_surface, medium };

struct Arrival {
  Meets what = Meets::nothing;
  int depth = 0;       // class, of `snow`
  bool thick = false;  // snow, of `snow`
  bool unlit = false;  // the walk stopped without having drawn that light comes here
  int scattered = 0;   // times on the way here
  float lit = 1;       // the chance that the last of them was to be connected to lights
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
  Similarity similarity;

  bool walks() const { return similarity == Similarity::by_collisions; }  // rays of share < 1 do
};

// Of the way between two points, so as not to meet the farther one's surface.
inline constexpr float kShort = 1 - 1e-4f;

// What flights know of each ray beside its geometry.
struct RayMarks {
  std::vector<std::uint64_t> key;  // makes its random numbers
  std::vector<float> share;        // what of the snow's extinction counts for it

  void clear() { key.clear(), share.clear(); }
  void push(std::uint64_t its_key, float its_share) { key.push_back(its_key), share.push_back(its_share); }
};

class Flights {
 public:
  explicit Flights(const World& world)
      : world_(world), inside_(world.image.snow_light == SnowLight::inside) {}

  // Ray i ends at arrivals[i], its t there; if it scattered before, its origin is where it did the last time,
  // and `lit` has where it was drawn to be connected to lights.
  // rays.hit: of a surface of snow, its ball or kSurfaceHit. `first`: camera rays, which the kernels like for
  // their neighbourhood.
  void fly(RayStream& rays, const RayMarks& marks, bool first, std::vector<Arrival>& arrivals,
           LitCollisions& lit);

  // The snow's surface before the rays' reach, as rays.hit and t. `coherent`: neighbours are neighbours in
  // space.
  void find_surface(RayStream& rays, bool coherent) const;

  // The first of the snow's surface, shapes and meshes before the rays' reach, as rays.t: rays.hit is of the
  // snow, objects[i] of what lies before it.
  void find(RayStream& rays, bool coherent, std::vector<ObjectHit>& objects) const;

  // Whether the surface lies there: rays.hit is 0 or kNoHit. `coherent`: neighbours are neighbours in space.
  void find_shadow(RayStream& rays, bool coherent = false) const;

  // What comes through of each ray up to its reach: 0 or 1 by objects and the snow (there by chance: on
  // average it is the transmittance), times that of other media.
  void pass(RayStream& rays, const RayMarks& marks, std::vector<Vec3f>& through);

 private:
  void find_objects(RayStream& rays, std::vector<ObjectHit>& objects) const;

  const World& world_;
  std::vector<ObjectHit> objects_;
  bool inside_;  // light scatters in the snow
};

}  // namespace firn
