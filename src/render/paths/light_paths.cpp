// SPDX-License-Identifier: MIT
// Light subpaths: they leave the lights, are seen by the camera, and leave their vertices for eye subpaths to
// connect to.
#include <algorithm>
#include <numeric>
#include <utility>

#include "src/core/infinity.h"
#include "src/render/paths/path.h"
#include "src/render/paths/path_draws.h"

namespace firn {
// `light`: what the subpath leaves, as a ray would come upon it.
bool TilePaths::start_light(Subpath& subpath, Vec3f& origin, Vec3f& direction, LightHit& light) const {
  const PathRandom& random = paths_[subpath.path].random;
  Emission start;
  if (!view_.world.lights.emit(random.pair(kLights + kLightChoice).u, random.pair(kLights + kLightPlace),
                               random.pair(kLights + kLightDirection), start))
    return false;
  origin = start.origin;
  direction = start.direction;
  light.light = start.light;
  light.pdf_emit = start.pdf_emit;
  light.cosine = start.cosine;
  subpath.beta = start.radiance * (start.cosine / start.pdf_emit);
  subpath.brightness = subpath.beta.maxCoeff();
  // The two densities of the first edge are known together: that of the light's point counts as 1.
  subpath.density = start.pdf_emit;
  subpath.cosine = start.cosine;
  subpath.distant = start.distant;
  subpath.trail.arrive(1, 0, 1);
  return subpath.brightness > 0;
}

void TilePaths::walk_lights(Film& film) {
  light_vertices_.clear();
  std::vector<std::uint32_t> path_of;
  lights_left_.resize(paths_.size());
  begin_subpaths();
  for (Subpath& subpath : subpaths_) {
    Vec3f origin, direction;
    if (start_light(subpath, origin, direction, lights_left_[subpath.path]))
      go_on(subpath, origin, direction, kLights);
  }
  while (fly(false)) {
    clear_links();
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
      Subpath& subpath = subpath_of(ray);
      const Meets what = arrivals_[ray].what;
      if (what == Meets::nothing || what == Meets::light) continue;
      if (subpath.vertices == 1) subpath.meets = first_meets(subpath, ray);
      const Vertex vertex = arrive(subpath, ray);
      if (!vertex.specular) {
        if (ways_.to_camera) show(subpath, vertex);
        if (ways_.to_light) {
          light_vertices_.push_back({vertex, subpath.trail});
          path_of.push_back(subpath.path);
        }
      }
      Vec3f direction;
      if (subpath.vertices < ways_.light_vertices &&
          leave(subpath, vertex, Carries::importance, kLights, direction))
        go_on(subpath, vertex.start(direction), direction, kLights);
    }
    pass();
    for (std::size_t k = 0; k < brings_.size(); ++k) {
      const Brings& brings = brings_[k];
      film.splat(brings.x, brings.y,
                 brings.light.cwiseProduct(through_[k]).cwiseProduct(view_.tint(brings.ice)),
                 paths_[brings.path].sample);
    }
  }
  sort_light_vertices(path_of);
}

// The first edge of a light subpath counts with the density by which an eye vertex chooses the light's point.
float TilePaths::first_meets(const Subpath& subpath, std::size_t ray) const {
  if (!ways_.to_light) return 0;
  const float t = subpath.distant ? kInfinity : rays_.t(ray);
  const float spread = subpath.distant ? 1.f : subpath.cosine / (t * t);
  return spread *
         view_.world.lights.pdf(rays_.at_hit(ray), -rays_.direction(ray), t, lights_left_[subpath.path]);
}

// Those of one path stand together, in the order of its steps.
void TilePaths::sort_light_vertices(const std::vector<std::uint32_t>& path_of) {
  std::vector<std::uint32_t> order(path_of.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return path_of[a] < path_of[b]; });
  std::vector<LightVertex> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t k : order) {
    Path& path = paths_[path_of[k]];
    if (path.first_light == path.end_light) path.first_light = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(light_vertices_[k]);
    path.end_light = static_cast<std::uint32_t>(sorted.size());
  }
  light_vertices_ = std::move(sorted);
}

// The ways that are open to the light's end of a path, beside that with `light` and `eye` vertices: those
// that give vertices to the eye subpath. A light that is come upon may be one vertex more.
int TilePaths::ways_to_eye(int light, int eye) const {
  return light <= ways_.eye_vertices - eye + 1 ? light : ways_.eye_vertices - eye;
}

void TilePaths::show(const Subpath& subpath, const Vertex& vertex) {
  const Path& path = paths_[subpath.path];
  CameraSight eye;
  if (!view_.camera.see(vertex.p, path.random.pair(kLights + pair_of(subpath.vertices, kSight)), eye)) return;
  const float seen = view_.camera.film_density(-eye.direction) * vertex.cosine(eye.direction) /
                     (eye.distance * eye.distance);
  const float pixels =
      static_cast<float>(view_.setup.image.width) * static_cast<float>(view_.setup.image.height);
  const double others = subpath.trail.others(seen / pixels, vertex.density(eye.direction, vertex.back),
                                             ways_.to_light ? ways_to_eye(subpath.vertices, 1) : 0);
  const Vec3f light = vertex.beta.cwiseProduct(vertex.scattered(eye.direction)) *
                      (seen * static_cast<float>(1 / (1 + others)));
  link(vertex.start(eye.direction), eye.direction, eye.distance,
       {subpath.path, light, vertex.ice, eye.x, eye.y});
}

}  // namespace firn
