// SPDX-License-Identifier: MIT
// The preview's rays: what each pixel sees, and where light is wanted.
#include "src/render/preview/preview.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "src/core/infinity.h"

namespace firn {
namespace {

constexpr int kStreamBlock = 8;  // pixels: neighbours in a stream are neighbours on the film
constexpr int kSpecular = 6;     // mirrors and sides of glass, one behind another

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

PreviewTile::PreviewTile(const View& view, const AmbientLight& ambient, const SnowLayers& layers)
    : view_(view),
      ambient_(ambient),
      layers_(layers),
      bare_(view.world.objects.empty() && !view.world.lights.any_lamps()) {
  for (const SnowLook& look : view.setup.snow) density_placed_.push_back(static_cast<float>(look.density));
}

std::uint64_t PreviewTile::trace(const Tile& tile, Picture& picture, PreviewTimes& times) {
  rays_traced_ = 0;
  Clock clock;
  aim(tile, !picture.layers.empty());
  points_.clear();
  for (int pass = 0; pass <= kSpecular && rays_.size() > 0; ++pass) find(pass == 0);
  find_normals();
  find_grain();
  if (!layered_.empty()) note_first();
  times.primary += clock.lap();
  probe();
  prepare();
  add_ambient();
  times.shade += clock.lap();
  for (int beacon = 0; beacon < view_.world.lights.beacons(); ++beacon) {
    cast_shadows(beacon);
    find_lit();
    times.shadow += clock.lap();
    find_glints();
    add_lit();
    times.shade += clock.lap();
  }
  paint(picture);
  times.shade += clock.lap();
  return rays_traced_;
}

void PreviewTile::aim(const Tile& tile, bool layered) {
  const auto most = static_cast<std::size_t>(tile.x1 - tile.x0) * static_cast<std::size_t>(tile.y1 - tile.y0);
  pixel_x_.resize(most), pixel_y_.resize(most);
  std::size_t count = 0;
  for (int y = tile.y0; y < tile.y1; y += kStreamBlock) {
    for (int x = tile.x0; x < tile.x1; x += kStreamBlock) {
      // In blocks of 2 x 2 in blocks of 4 x 4 in blocks of 8 x 8.
      for (int k = 0; k < kStreamBlock * kStreamBlock; ++k) {
        const int px = x + (k >> 4 & 1) * 4 + (k >> 2 & 1) * 2 + (k & 1);
        const int py = y + (k >> 5) * 4 + (k >> 3 & 1) * 2 + (k >> 1 & 1);
        if (px < tile.x1 && py < tile.y1) pixel_x_[count] = px, pixel_y_[count++] = py;
      }
    }
  }
  rays_.begin(count, view_.camera.eye(), kInfinity);
  spread_.resize(count);
  float* const directions[3] = {rays_.directions(0), rays_.directions(1), rays_.directions(2)};
  view_.shade.sights(view_.camera.pinhole(), pixel_x_.data(), pixel_y_.data(), 0, count, directions,
                     spread_.data());
  beauty_.assign(count, Vec3f::Zero());
  layered_.assign(layered ? count : 0, {});
}

void PreviewTile::find(bool first) {
  next_rays_.clear(), next_sights_.clear();
  Flights(view_.world).find(rays_, first, objects_);
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
  const ObjectHit& met = objects_[ray];
  LightHit light;
  bool glows = false;
  if (!bare_) {
    glows = world.lights.hit(o, d, t, light) ||
            (met.object >= 0 && world.lights.object_hit(met.object, d, met, light));
  }
  const Sight sight =
      first ? Sight{static_cast<std::uint32_t>(ray), Vec3f::Ones(), spread_[ray]} : sights_[ray];
  if (glows || (met.object < 0 && !snow)) {
    const Vec3f radiance = glows ? light.radiance : world.lights.background(d);
    beauty_[sight.pixel] += sight.weight.cwiseProduct(radiance);
    return;
  }
  if (first && !layered_.empty()) layered_[sight.pixel].depth = t;
  const Vec3f p = rays_.at_hit(ray);
  if (met.object < 0) {
    add_point(sight, t, p, -d).sorted = rays_.hit(ray);
    return;
  }
  SurfacePoint surface = world.objects.point(met);
  if (is_specular(surface)) {
    go_on(ray, sight, surface, p);
    return;
  }
  if (surface.normal.dot(d) > 0) surface.normal = -surface.normal;
  Point& point = add_point(sight, t, p, -d);
  point.surface = surface;
  point.smooth = surface.normal;
  point.lift = 4e-6f * std::max(p.cwiseAbs().maxCoeff(), t);
}

PreviewTile::Point& PreviewTile::add_point(const Sight& sight, float t, const Vec3f& p, const Vec3f& back) {
  Point& point = points_.emplace_back();
  point.pixel = sight.pixel;
  point.weight = sight.weight;
  point.footprint = t * sight.spread;
  point.p = p;
  point.back = back;
  return point;
}

// Mirrors reflect; glass lets through what it does not reflect wholly, and nothing shows as far as it is
// reflected.
void PreviewTile::go_on(std::size_t ray, const Sight& sight, const SurfacePoint& surface, const Vec3f& p) {
  Scattered scattered;
  constexpr float kThrough = 0.99999f;
  if (!scatter(surface, -rays_.direction(ray), kThrough, {0.5f, 0.5f}, Carries::radiance, scattered)) return;
  const bool ahead = surface.normal.dot(scattered.direction) > 0;
  const float off = 4e-6f * std::max(p.cwiseAbs().maxCoeff(), rays_.t(ray));
  next_rays_.push(p + (ahead ? off : -off) * surface.normal, scattered.direction, kInfinity);
  next_sights_.push_back({sight.pixel, sight.weight.cwiseProduct(scattered.weight), 0});
}

// The particle and the smooth normal of each point of snow.
void PreviewTile::find_normals() {
  snow_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (points_[k].snow()) snow_.push_back(static_cast<std::uint32_t>(k));
  }
  const std::size_t count = snow_.size();
  for (auto* columns : {&place_, &smooth_}) columns->resize(count);
  particle_.resize(count);
  for (std::size_t s = 0; s < count; ++s) place_.set(s, points_[snow_[s]].p);
  if (view_.setup.image.snow == SnowShape::smooth) {
    const kernels::TraceGrid& grid = view_.grid.view();
    view_.shade.nearest(grid, place_.view(), 0, count, particle_.data());
    smooth_.fill([&](float* const normal[3]) {
      view_.shade.normals(grid, view_.field.gradients(), place_.view(), 0, count, normal);
    });
  }
  for (std::size_t s = 0; s < count; ++s) {
    Point& point = points_[snow_[s]];
    if (point.sorted != kernels::kSurfaceHit) {
      point.smooth = (point.p - view_.grid.center(point.sorted)) / view_.grid.radius(point.sorted);
      smooth_.set(s, point.smooth);
      continue;
    }
    const bool near = particle_[s] != kernels::kNoHit;
    point.sorted = near ? particle_[s] : view_.field.particle_at_surface(point.p);
    point.smooth = smooth_[s];
    if (point.smooth.squaredNorm() > 0) continue;
    point.smooth = point.back;
    smooth_.set(s, point.smooth);
  }
}

// What the particles add. As the path tracer has it (TilePaths::become_surface), but for where light leaves.
void PreviewTile::find_grain() {
  const std::size_t count = snow_.size();
  const auto spacing = static_cast<float>(view_.grid.spacing());
  for (auto* columns : {&local_, &back_, &normal_}) columns->resize(count);
  id_.resize(count);
  for (std::size_t s = 0; s < count; ++s) {
    Point& point = points_[snow_[s]];
    const std::uint32_t particle = view_.grid.snapshot_index(point.sorted);
    point.object = view_.snapshot.object[particle];
    id_[s] = view_.snapshot.id[particle];
    local_.set(s, (point.p - view_.grid.center(point.sorted)) / spacing);
    back_.set(s, point.back);
  }
  const kernels::GrainView grain{smooth_.view(), local_.view(), back_.view(), id_.data()};
  normal_.fill([&](float* const normal[3]) { view_.shade.grain(grain, 0, count, normal); });
  for (std::size_t s = 0; s < count; ++s) {
    Point& point = points_[snow_[s]];
    point.surface.normal = normal_[s];
    point.surface.albedo = view_.grains.of(point.object, false).layer;
  }
}

// What the film keeps of the points that pixels see straight.
void PreviewTile::note_first() {
  for (const Point& point : points_) {
    if (!(point.footprint > 0)) continue;
    FilmSample& seen = layered_[point.pixel];
    seen.normal = point.smooth;
    seen.albedo = point.surface.albedo;
  }
}

void PreviewTile::paint(Picture& picture) const {
  const auto put = [&](std::vector<float>& values, std::size_t at, const Vec3f& v) {
    for (int c = 0; c < 3; ++c) values[3 * at + c] = v[c];
  };
  for (std::size_t k = 0; k < beauty_.size(); ++k) {
    const std::size_t at = static_cast<std::size_t>(pixel_y_[k]) * picture.width + pixel_x_[k];
    put(picture.rgb, at, beauty_[k]);
    for (LayerImage& layer : picture.layers) {
      const FilmSample& seen = layered_[k];
      switch (layer.layer) {
        case Layer::beauty:
          break;
        case Layer::albedo:
          put(layer.values, at, seen.albedo);
          break;
        case Layer::normal:
          put(layer.values, at, seen.normal);
          break;
        case Layer::depth:
          layer.values[at] = seen.depth;
          break;
        case Layer::sparkle:
          put(layer.values, at, seen.sparkle);
          break;
        case Layer::subsurface:
          put(layer.values, at, seen.subsurface);
          break;
        case Layer::samples:
          layer.values[at] = 1;
          break;
        case Layer::variance:  // of one sample nothing is known
          layer.values[at] = kInfinity;
          break;
      }
    }
  }
}

}  // namespace firn
