// SPDX-License-Identifier: MIT
#include "src/render/path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "src/render/directions.h"
#include "src/render/grain.h"

namespace firn {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kSamplesAtOnce = 16;  // a pixel; bounds the memory of a tile
constexpr int kBlock = 4;                     // pixels: neighbours in a stream are neighbours on the film
constexpr std::uint32_t kRouletteDepth = 4;
// Rays leave snow this far (in particle spacings) above the ball that was hit, along the smooth normal: clear
// of the neighbouring balls, whose bumps are not a feature of the snow.
constexpr float kSnowLift = 1.0f;
// And within this distance aside of it (in particle spacings): light that enters snow comes out elsewhere. A
// poor man's subsurface transport: it keeps energy, softens shadows at the size of a particle, and needs no
// walk through the snow.
constexpr float kEmergence = 1.5f;

// Pairs of sample dimensions: one for the film, then four at every vertex.
constexpr std::uint32_t kFilmPair = 0;
enum VertexPair : std::uint32_t { light_point = 1, bounce_direction, choices, emergence };
constexpr std::uint32_t pair_of(std::uint32_t depth, VertexPair which) { return 4 * depth + which; }

}  // namespace

Sample2 TilePaths::draw(const Path& path, std::uint32_t pair) const {
  const auto pixel =
      static_cast<std::uint64_t>(path.pixel_y) << 32 | static_cast<std::uint32_t>(path.pixel_x);
  const Sampler sampler(view_.setup.seed, static_cast<std::uint64_t>(view_.snapshot.frame), pixel);
  return sampler.pair(path.sample, pair);
}

std::uint64_t TilePaths::trace(const Tile& tile, Film& film) {
  rays_traced_ = 0;
  const auto samples = static_cast<std::uint32_t>(view_.setup.image.samples);
  const auto depths = static_cast<std::uint32_t>(view_.setup.image.max_bounces);
  std::vector<Vec3f> sums(static_cast<std::size_t>(tile.x1 - tile.x0) * (tile.y1 - tile.y0), Vec3f::Zero());
  for (std::uint32_t first = 0; first < samples; first += kSamplesAtOnce) {
    start_paths(tile, first, std::min(first + kSamplesAtOnce, samples));
    for (std::uint32_t depth = 0; depth <= depths + 1 && rays_.size() > 0; ++depth) {
      meet(depth);
      shade(depth);
      trace_shadows();
      std::swap(rays_, next_rays_);
      std::swap(path_of_, next_path_of_);
    }
    add_to(tile, sums);
  }
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const Vec3f mean =
          sums[(y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0] / static_cast<float>(samples);
      for (int c = 0; c < 3; ++c) film.pixel(x, y)[c] = mean[c];
    }
  }
  return rays_traced_;
}

void TilePaths::start_paths(const Tile& tile, std::uint32_t first_sample, std::uint32_t last_sample) {
  paths_.clear();
  rays_.clear();
  path_of_.clear();
  const Vec3f eye = (view_.camera.position() - view_.grid.origin()).cast<float>();
  for (int y = tile.y0; y < tile.y1; y += kBlock) {
    for (int x = tile.x0; x < tile.x1; x += kBlock) {
      for (std::uint32_t sample = first_sample; sample < last_sample; ++sample) {
        for (int py = y; py < std::min(y + kBlock, tile.y1); ++py) {
          for (int px = x; px < std::min(x + kBlock, tile.x1); ++px) {
            const Path path{Vec3f::Ones(), Vec3f::Zero(), px, py, sample, true, true};
            path_of_.push_back(static_cast<std::uint32_t>(paths_.size()));
            rays_.push(eye, view_.camera.direction(px, py, draw(path, kFilmPair)), kInfinity);
            paths_.push_back(path);
          }
        }
      }
    }
  }
}

// Finds for every ray the nearest of object, lamp and snow.
void TilePaths::meet(std::uint32_t depth) {
  const std::size_t count = rays_.size();
  meetings_.resize(count);
  lamp_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f o = rays_.origin(i), d = rays_.direction(i);
    meetings_[i] = view_.objects.closest(o, d, rays_.t(i));
    if (meetings_[i].object >= 0) rays_.t(i) = meetings_[i].t;
    if (!view_.lights.hit(o, d, rays_.t(i), lamp_[i])) lamp_[i].light = -1;
  }
  if (view_.setup.image.snow == SnowShape::smooth) {
    view_.kernels.surface_closest(view_.snow.view(), view_.snow.surface(), rays_.view(), 0, count);
  } else {
    const auto closest = depth == 0 ? view_.kernels.closest_coherent : view_.kernels.closest;
    closest(view_.grid.view(), rays_.view(), 0, count);
  }
  rays_traced_ += count;
}

TilePaths::Vertex TilePaths::snow_vertex(std::size_t ray, const Path& path, std::uint32_t depth) const {
  const auto spacing = static_cast<float>(view_.grid.spacing());
  const Vec3f p = rays_.at_hit(ray), d = rays_.direction(ray);
  const bool ball = rays_.hit(ray) != kernels::kSurfaceHit;
  const std::uint32_t sorted = ball ? rays_.hit(ray) : view_.snow.particle_near(p);
  const std::uint32_t particle = view_.grid.snapshot_index(sorted);
  const Vec3f from_center = p - view_.grid.center(sorted);
  const Vec3f smooth = ball ? Vec3f(from_center / view_.grid.radius(sorted)) : view_.snow.normal(p, -d);
  const Vec3f grains = grain_slope(from_center / spacing, view_.snapshot.id[particle]);
  Vec3f normal = (smooth + grains).normalized();
  const float facing = normal.dot(d);
  // A smooth normal that looks away from the viewer is turned until it sees him edge on.
  if (facing > -0.02f) normal = (normal - (facing + 0.02f) * d).normalized();
  const Sample2 at = draw(path, pair_of(depth, emergence));
  const Disc aside = on_circle(kEmergence * spacing * std::sqrt(at.u), at.v);
  const Vec3f start = p + around(smooth, aside.x, aside.y, kSnowLift * spacing);
  const auto& looks = view_.setup.snow;
  const std::size_t object = view_.snapshot.object[particle];
  const Vec3f albedo = looks.empty() ? SnowLook{}.albedo : looks[std::min(object, looks.size() - 1)].albedo;
  return {start, normal, albedo, SurfaceKind::diffuse};
}

TilePaths::Vertex TilePaths::object_vertex(std::size_t ray) const {
  const ObjectHit& hit = meetings_[ray];
  const Vec3f p = rays_.at_hit(ray);
  const Vec3f normal = hit.normal.dot(rays_.direction(ray)) > 0 ? Vec3f(-hit.normal) : hit.normal;
  const float off = 4e-6f * std::max(p.cwiseAbs().maxCoeff(), rays_.t(ray));
  return {p + off * normal, normal, hit.albedo, view_.objects.surface(hit.object).kind};
}

// Sampling of lights finds the same light: the balance heuristic (Veach 1997) shares it.
void TilePaths::find_light(std::size_t ray, Path& path, const LightHit& hit) const {
  const float other = view_.lights.pdf(rays_.origin(ray), rays_.direction(ray), rays_.t(ray), hit);
  const float share = path.pdf < kInfinity ? path.pdf / (path.pdf + other) : 1;
  path.light += path.beta.cwiseProduct(hit.radiance) * share;
}

// Adds the light that the path finds where its ray ends; false if it ends there.
bool TilePaths::arrive(std::size_t ray, std::uint32_t depth, Path& path, Vertex& vertex) const {
  if (rays_.hit(ray) != kernels::kNoHit) {
    vertex = snow_vertex(ray, path, depth);
    return true;
  }
  const Vec3f o = rays_.origin(ray), d = rays_.direction(ray);
  const ObjectHit& met = meetings_[ray];
  LightHit light = lamp_[ray];
  const bool lamp = light.light >= 0;
  if (!lamp && met.object < 0) light = view_.lights.escape(o, d);
  if (lamp || met.object < 0 || view_.lights.object_hit(met.object, o, d, met, light)) {
    find_light(ray, path, light);
    return false;
  }
  vertex = object_vertex(ray);
  return true;
}

void TilePaths::shade(std::uint32_t depth) {
  next_rays_.clear();
  next_path_of_.clear();
  shadows_.clear();
  path_of_shadow_.clear();
  shadow_light_.clear();
  const bool last = depth > static_cast<std::uint32_t>(view_.setup.image.max_bounces);
  for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
    const std::uint32_t path = path_of_[ray];
    Vertex vertex;
    if (!arrive(ray, depth, paths_[path], vertex) || last) continue;
    if (vertex.kind == SurfaceKind::diffuse) sample_light(path, vertex, depth);
    if (vertex.kind == SurfaceKind::mirror) {
      const Vec3f d = rays_.direction(ray);
      paths_[path].beta = paths_[path].beta.cwiseProduct(vertex.albedo);
      paths_[path].sees_lamps = true;
      next_rays_.push(vertex.start, (d - 2 * vertex.normal.dot(d) * vertex.normal).normalized(), kInfinity);
      next_path_of_.push_back(path);
    } else {
      bounce(path, vertex, depth);
    }
  }
}

void TilePaths::sample_light(std::uint32_t index, const Vertex& vertex, std::uint32_t depth) {
  const Path& path = paths_[index];
  LightSample light;
  const float choice = draw(path, pair_of(depth, choices)).u;
  if (!view_.lights.sample(vertex.start, choice, draw(path, pair_of(depth, light_point)), light)) return;
  const float cosine = light.direction.dot(vertex.normal);
  if (cosine <= 0 || view_.objects.occluded(vertex.start, light.direction, light.distance)) return;
  shadows_.push(vertex.start, light.direction, light.distance);
  path_of_shadow_.push_back(index);
  shadow_light_.push_back(path.beta.cwiseProduct(vertex.albedo).cwiseProduct(light.radiance_by_pdf) *
                          (cosine / kPi));
}

// Cosine sampling: throughput changes by the albedo alone. Roulette ends dim paths without bias.
void TilePaths::bounce(std::uint32_t index, const Vertex& vertex, std::uint32_t depth) {
  Path& path = paths_[index];
  path.beta = path.beta.cwiseProduct(vertex.albedo);
  path.sees_lamps = false;
  path.sees_sun = false;
  const float strongest = path.beta.maxCoeff();
  if (strongest <= 0) return;
  if (depth >= kRouletteDepth && strongest < 1) {
    if (draw(path, pair_of(depth, choices)).v >= strongest) return;
    path.beta /= strongest;
  }
  const Vec3f direction = cosine_direction(vertex.normal, draw(path, pair_of(depth, bounce_direction)));
  next_rays_.push(vertex.start, direction, kInfinity);
  next_path_of_.push_back(index);
}

void TilePaths::trace_shadows() {
  if (view_.setup.image.snow == SnowShape::smooth) {
    view_.kernels.surface_occluded(view_.snow.view(), view_.snow.surface(), shadows_.view(), 0,
                                   shadows_.size());
  } else {
    view_.kernels.occluded(view_.grid.view(), shadows_.view(), 0, shadows_.size());
  }
  rays_traced_ += shadows_.size();
  for (std::size_t i = 0; i < shadows_.size(); ++i) {
    if (shadows_.hit(i) == kernels::kNoHit) paths_[path_of_shadow_[i]].light += shadow_light_[i];
  }
}

void TilePaths::add_to(const Tile& tile, std::vector<Vec3f>& sums) const {
  for (const Path& path : paths_) {
    sums[(path.pixel_y - tile.y0) * (tile.x1 - tile.x0) + path.pixel_x - tile.x0] += path.light;
  }
}

}  // namespace firn
