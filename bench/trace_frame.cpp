// SPDX-License-Identifier: MIT
#include "bench/trace_frame.h"

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "bench/stopwatch.h"
#include "src/core/parallel.h"
#include "src/core/rng.h"

namespace firn::bench {

namespace {

constexpr int kTile = 8;  // pixels; a tile's rays follow one another in the columns
constexpr std::size_t kPixels = std::size_t{kFilmWidth} * kFilmHeight;
static_assert(kPixels % RayPacks::kPack == 0 && kFilmWidth % kTile == 0 && kFilmHeight % kTile == 0);
constexpr float kAlbedo = 0.9f;
constexpr float kLift = 1e-3f;  // m: rays start so far above the surface, not to meet it again
constexpr std::uint64_t kDirectionSeed = 7;
constexpr std::size_t kDirections = 4096;
constexpr float kFar = std::numeric_limits<float>::infinity();

struct Pixel {
  int x, y;
};

// Of the i-th camera ray: tile by tile, in rows.
Pixel pixel_of(std::size_t i) {
  constexpr int kTilesAcross = kFilmWidth / kTile;
  const int in_tile = static_cast<int>(i % (kTile * kTile)), tile = static_cast<int>(i / (kTile * kTile));
  return {tile % kTilesAcross * kTile + in_tile % kTile, tile / kTilesAcross * kTile + in_tile / kTile};
}

template <class Body>
void for_each_pack(const RayPacks& rays, Body&& body) {
  parallel_for(rays.packs(), 1, body);
}

}  // namespace

RayPacks::RayPacks(std::size_t rays) : t(rays), hit(rays), pixel(rays), used_((rays + kPack - 1) / kPack, 0) {
  for (auto& column : origin) column.resize(rays);
  for (auto& column : direction) column.resize(rays);
}

kernels::RayView RayPacks::view() {
  return {{origin[0].data(), origin[1].data(), origin[2].data()},
          {direction[0].data(), direction[1].data(), direction[2].data()},
          t.data(),
          hit.data()};
}

void RayPacks::push(std::size_t pack, const Vec3f& from, const Vec3f& along, float reach, std::uint32_t at) {
  const std::size_t i = end(pack);
  for (int axis = 0; axis < 3; ++axis) {
    origin[axis][i] = from[axis];
    direction[axis][i] = along[axis];
  }
  t[i] = reach;
  pixel[i] = at;
  ++used_[pack];
}

std::size_t RayPacks::size() const {
  std::size_t sum = 0;
  for (const std::size_t used : used_) sum += used;
  return sum;
}

TraceFrame::TraceFrame(const TraceScene& scene, int busy_threads)
    : scene_(scene),
      busy_threads_(busy_threads),
      primary_(kPixels),
      shadow_(kPixels),
      bounce_(kPixels),
      cosine_(kPixels),
      film_(kPixels) {
  for (auto& column : normal_) column.resize(kPixels);
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double z = 2 * uniform_double(hash_keys(kDirectionSeed, i, 0)) - 1, r = std::sqrt(1 - z * z);
    const double angle = 2 * std::numbers::pi * uniform_double(hash_keys(kDirectionSeed, i, 1));
    sphere_.push_back(Vec3(r * std::cos(angle), r * std::sin(angle), z).cast<float>());
  }
}

template <class Work>
double TraceFrame::timed(Work&& work) const {
  return busy_threads_ > 0 ? cpu_seconds_of(work) / busy_threads_ : seconds_of(work);
}

// One ray through the middle of each pixel.
void TraceFrame::aim_camera(const Vec3& origin) {
  const Vec3 forward = (scene_.center - scene_.camera).normalized();
  const Vec3 right = forward.cross(Vec3::UnitY()).normalized(), down = forward.cross(right);
  const double pixel = 2 * std::tan(kViewAngle / 2 * std::numbers::pi / 180) / kFilmHeight;
  const Vec3f from = (scene_.camera - origin).cast<float>();
  const Vec3f corner =
      (forward + pixel * (0.5 - kFilmWidth / 2.0) * right + pixel * (0.5 - kFilmHeight / 2.0) * down)
          .cast<float>();
  const Vec3f across = (pixel * right).cast<float>(), below = (pixel * down).cast<float>();
  for_each_pack(primary_, [&](std::size_t pack) {
    primary_.clear(pack);
    for (std::size_t i = primary_.begin(pack); i < primary_.begin(pack) + RayPacks::kPack; ++i) {
      const Pixel p = pixel_of(i);
      const Vec3f along = corner + static_cast<float>(p.x) * across + static_cast<float>(p.y) * below;
      primary_.push(pack, from, along.normalized(), kFar, static_cast<std::uint32_t>(p.y * kFilmWidth + p.x));
    }
  });
}

RayTally TraceFrame::trace(Tracer& tracer, RayKind kind, RayPacks& rays) {
  RayTally tally;
  const kernels::RayView view = rays.view();
  tally.seconds = timed([&] {
    for_each_pack(rays,
                  [&](std::size_t pack) { tracer.trace(kind, view, rays.begin(pack), rays.end(pack)); });
  });
  return tally;
}

// Normals, the direct light that shadow rays will decide about, and the shadow rays.
void TraceFrame::shade(const Tracer& tracer) {
  const Vec3f light = (scene_.light - tracer.origin()).cast<float>();
  for_each_pack(primary_, [&](std::size_t pack) {
    shadow_.clear(pack);
    for (std::size_t i = primary_.begin(pack); i < primary_.end(pack); ++i) {
      film_[primary_.pixel[i]] = 0;
      if (primary_.hit[i] == kernels::kNoHit) continue;
      const Vec3f along(primary_.direction[0][i], primary_.direction[1][i], primary_.direction[2][i]);
      const Vec3f from(primary_.origin[0][i], primary_.origin[1][i], primary_.origin[2][i]);
      const Vec3f at = from + primary_.t[i] * along;
      const Vec3f normal = (at - tracer.center(primary_.hit[i])).normalized();
      for (int axis = 0; axis < 3; ++axis) normal_[axis][i] = normal[axis];
      const Vec3f start = at + kLift * normal, to_light = light - start;
      const float distance = to_light.norm(), cosine = normal.dot(to_light) / distance;
      if (cosine <= 0) continue;
      cosine_[shadow_.end(pack)] = cosine;
      shadow_.push(pack, start, to_light / distance, distance, primary_.pixel[i]);
    }
  });
}

void TraceFrame::add_light() {
  for_each_pack(shadow_, [&](std::size_t pack) {
    for (std::size_t i = shadow_.begin(pack); i < shadow_.end(pack); ++i) {
      if (shadow_.hit[i] == kernels::kNoHit) film_[shadow_.pixel[i]] = kAlbedo * cosine_[i];
    }
  });
}

// A direction of the unit sphere added to the normal is cosine-distributed about it.
void TraceFrame::scatter() {
  for_each_pack(primary_, [&](std::size_t pack) {
    bounce_.clear(pack);
    for (std::size_t i = primary_.begin(pack); i < primary_.end(pack); ++i) {
      if (primary_.hit[i] == kernels::kNoHit) continue;
      const Vec3f along(primary_.direction[0][i], primary_.direction[1][i], primary_.direction[2][i]);
      const Vec3f from(primary_.origin[0][i], primary_.origin[1][i], primary_.origin[2][i]);
      const Vec3f normal(normal_[0][i], normal_[1][i], normal_[2][i]);
      const Vec3f sum = normal + sphere_[mix64(primary_.pixel[i]) % kDirections];
      const float length = sum.norm();
      const Vec3f out = length > 1e-3f ? Vec3f(sum / length) : normal;
      bounce_.push(pack, from + primary_.t[i] * along + kLift * normal, out, kFar, primary_.pixel[i]);
    }
  });
}

void TraceFrame::add_sky() {
  for_each_pack(bounce_, [&](std::size_t pack) {
    for (std::size_t i = bounce_.begin(pack); i < bounce_.end(pack); ++i) {
      if (bounce_.hit[i] == kernels::kNoHit) film_[bounce_.pixel[i]] += kAlbedo;
    }
  });
}

namespace {

// Rays and hits, outside of what is timed.
void count(const RayPacks& rays, bool has_distance, RayTally& tally) {
  double sum = 0;
  for (std::size_t pack = 0; pack < rays.packs(); ++pack) {
    for (std::size_t i = rays.begin(pack); i < rays.end(pack); ++i) {
      if (rays.hit[i] == kernels::kNoHit) continue;
      ++tally.hits;
      if (has_distance) sum += rays.t[i];
    }
  }
  tally.rays = rays.size();
  if (tally.hits > 0) tally.mean_t = sum / static_cast<double>(tally.hits);
}

}  // namespace

FrameTally TraceFrame::render(Tracer& tracer) {
  FrameTally tally;
  RayTally &primary = tally.rays[0], &shadow = tally.rays[1], &bounce = tally.rays[2];
  tally.build = timed([&] { tracer.build(); });
  const double all = timed([&] {
    aim_camera(tracer.origin());
    primary = trace(tracer, RayKind::primary, primary_);
    shade(tracer);
    shadow = trace(tracer, RayKind::shadow, shadow_);
    add_light();
    scatter();
    bounce = trace(tracer, RayKind::bounce, bounce_);
    add_sky();
  });
  tally.interactive = tally.build + primary.seconds + shadow.seconds;
  tally.frame = tally.interactive + bounce.seconds;
  tally.shading = tally.build + all - tally.frame;
  count(primary_, true, primary);
  count(shadow_, false, shadow);
  count(bounce_, true, bounce);
  return tally;
}

}  // namespace firn::bench
