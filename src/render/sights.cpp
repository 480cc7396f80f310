// SPDX-License-Identifier: MIT
#include "src/render/sights.h"

#include <cstdint>

#include "src/core/infinity.h"
#include "src/render/paths/path.h"

namespace firn {

Sights& Sights::operator+=(const Sights& other) {
  pixels += other.pixels;
  nothing += other.nothing;
  for (std::size_t i = 0; i < snow.size(); ++i) snow[i] += other.snow[i];
  for (std::size_t i = 0; i < objects.size(); ++i) objects[i] += other.objects[i];
  return *this;
}

Sights no_sights(const RenderSetup& setup) {
  Sights sights;
  sights.snow.resize(setup.snow.size());
  sights.objects.resize(setup.objects.size());
  return sights;
}

Sights sights_of(const View& view, const Tile& tile) {
  RayStream rays;
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const CameraRay ray = view.camera.middle_ray(x, y);
      rays.push(ray.origin, ray.direction, kInfinity);
    }
  }
  std::vector<ObjectHit> met;
  Flights(view.world).find(rays, true, met);
  Sights seen = no_sights(view.setup);
  seen.pixels = rays.size();
  for (std::size_t ray = 0; ray < rays.size(); ++ray) {
    if (met[ray].object >= 0) {
      ++seen.objects[static_cast<std::size_t>(met[ray].object)];
    } else if (rays.hit(ray) == kernels::kNoHit) {
      ++seen.nothing;
    } else {
      const bool surface = rays.hit(ray) == kernels::kSurfaceHit;
      const std::uint32_t sorted = surface ? view.field.particle_at_surface(rays.at_hit(ray)) : rays.hit(ray);
      ++seen.snow[view.snapshot.object[view.grid.snapshot_index(sorted)]];
    }
  }
  return seen;
}

}  // namespace firn
