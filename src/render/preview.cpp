// SPDX-License-Identifier: MIT
// The preview's rays: what each pixel sees, and where light is wanted.
#include "src/render/preview.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "src/render/grain.h"

namespace firn {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kBlock = 8;         // pixels: neighbours in a stream are neighbours on the film
constexpr int kSpecular = 6;      // mirrors and sides of glass, one behind another
constexpr float kFacing = 0.02f;  // of a grain's normal to the eye, at least

class Clock {
 public:
  // s since it was asked last.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

std::uint64_t PreviewTile::trace(const Tile& tile, Film& film, PreviewTimes& times) {
  rays_traced_ = 0;
  Clock clock;
  aim(tile);
  points_.clear();
  for (int pass = 0; pass <= kSpecular && rays_.size() > 0; ++pass) find(pass == 0);
  times.primary += clock.lap();
  probe();
  prepare();
  add_ambient();
  times.shade += clock.lap();
  for (int beacon = 0; beacon < view_.world.lights.beacons(); ++beacon) {
    cast_shadows(beacon);
    times.shadow += clock.lap();
    add_lit();
    times.shade += clock.lap();
  }
  for (const Pixel& pixel : pixels_) film.add(pixel.x, pixel.y, pixel.seen);
  times.shade += clock.lap();
  return rays_traced_;
}

void PreviewTile::aim(const Tile& tile) {
  pixels_.clear(), sights_.clear(), rays_.clear();
  for (int y = tile.y0; y < tile.y1; y += kBlock) {
    for (int x = tile.x0; x < tile.x1; x += kBlock) {
      for (int py = y; py < std::min(y + kBlock, tile.y1); ++py) {
        for (int px = x; px < std::min(x + kBlock, tile.x1); ++px) {
          const CameraRay ray = view_.camera.middle_ray(px, py);
          rays_.push(ray.origin, ray.direction, kInfinity);
          sights_.push_back({static_cast<std::uint32_t>(pixels_.size()), Vec3f::Ones()});
          pixels_.push_back({px, py, {}});
        }
      }
    }
  }
}

void PreviewTile::find(bool first) {
  next_rays_.clear(), next_sights_.clear();
  Flights(view_.world).find_surface(rays_, first);
  rays_traced_ += rays_.size();
  for (std::size_t ray = 0; ray < rays_.size(); ++ray) arrive(ray, first);
  std::swap(rays_, next_rays_);
  std::swap(sights_, next_sights_);
}

void PreviewTile::arrive(std::size_t ray, bool first) {
  const World& world = view_.world;
  const Vec3f o = rays_.origin(ray), d = rays_.direction(ray);
  float& t = rays_.t(ray);
  const bool snow = rays_.hit(ray) != kernels::kNoHit;
  const ObjectHit met = world.objects.closest(o, d, t);
  if (met.object >= 0) t = met.t;
  LightHit light;
  FilmSample& seen = pixels_[sights_[ray].pixel].seen;
  const bool glows = world.lights.hit(o, d, t, light) ||
                     (met.object >= 0 && world.lights.object_hit(met.object, d, met, light));
  if (glows || (met.object < 0 && !snow)) {
    const Vec3f radiance = glows ? light.radiance : world.lights.background(d);
    seen.beauty += sights_[ray].weight.cwiseProduct(radiance);
    return;
  }
  Point point;
  if (met.object >= 0) {
    point.surface = world.objects.point(met);
    point.p = rays_.at_hit(ray);
    if (is_specular(point.surface)) {
      go_on(ray, point.surface, point.p);
      return;
    }
    if (point.surface.normal.dot(d) > 0) point.surface.normal = -point.surface.normal;
    point.smooth = point.surface.normal;
    point.back = -d;
    point.lift = 4e-6f * std::max(point.p.cwiseAbs().maxCoeff(), t);
  } else {
    point = snow_point(ray);
  }
  point.pixel = sights_[ray].pixel;
  point.weight = sights_[ray].weight;
  if (first) {
    seen.depth = t;
    seen.normal = point.smooth;
    seen.albedo = point.surface.albedo;
    point.footprint = 0.5f * t / std::sqrt(view_.camera.film_density(d));
  }
  points_.push_back(point);
}

// Mirrors reflect; glass lets through what it does not reflect wholly, and nothing shows as far as it is
// reflected.
void PreviewTile::go_on(std::size_t ray, const SurfacePoint& surface, const Vec3f& p) {
  Scattered scattered;
  constexpr float kThrough = 0.99999f;
  if (!scatter(surface, -rays_.direction(ray), kThrough, {0.5f, 0.5f}, Carries::radiance, scattered)) return;
  const bool ahead = surface.normal.dot(scattered.direction) > 0;
  const float off = 4e-6f * std::max(p.cwiseAbs().maxCoeff(), rays_.t(ray));
  next_rays_.push(p + (ahead ? off : -off) * surface.normal, scattered.direction, kInfinity);
  next_sights_.push_back({sights_[ray].pixel, sights_[ray].weight.cwiseProduct(scattered.weight)});
}

// As the path tracer has it (TilePaths::become_surface), but for where light leaves.
PreviewTile::Point PreviewTile::snow_point(std::size_t ray) const {
  const auto spacing = static_cast<float>(view_.grid.spacing());
  Point point;
  point.p = rays_.at_hit(ray);
  point.back = -rays_.direction(ray);
  const bool ball = rays_.hit(ray) != kernels::kSurfaceHit;
  point.sorted = ball ? rays_.hit(ray) : view_.field.particle_near(point.p);
  const std::uint32_t particle = view_.grid.snapshot_index(point.sorted);
  const Vec3f from_center = point.p - view_.grid.center(point.sorted);
  point.smooth =
      ball ? Vec3f(from_center / view_.grid.radius(point.sorted)) : view_.field.normal(point.p, point.back);
  Vec3f normal =
      (point.smooth + grain_slope(from_center / spacing, view_.snapshot.id[particle])).normalized();
  const float facing = normal.dot(point.back);
  if (facing < kFacing) normal = (normal + (kFacing - facing) * point.back).normalized();
  point.object = view_.snapshot.object[particle];
  point.surface.normal = normal;
  point.surface.albedo = view_.grains.of(point.object, false).layer;
  point.lift = spacing;
  return point;
}

}  // namespace firn
