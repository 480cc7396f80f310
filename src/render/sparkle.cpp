// SPDX-License-Identifier: MIT
#include "src/render/sparkle.h"

#include <algorithm>
#include <cmath>

#include "src/core/portable_math.h"
#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/render/directions.h"

namespace firn {
namespace {

// A particle that stands for more facets has this many, larger ones of the same area in all.
constexpr float kMostFacets = 32;
constexpr float kIce = 1.31f;  // refractive index in the middle of the visible

std::uint64_t facet_bits(std::uint32_t particle_id, std::uint32_t number) {
  return mix64(static_cast<std::uint64_t>(particle_id) << 32 | number);
}

// Reflectance of a flat side of ice, unpolarised.
float fresnel(float cosine) {
  const float inside =
      std::sqrt(kIce * kIce - 1 + cosine * cosine);  // index times cosine of the refracted ray
  const float across = (cosine - inside) / (cosine + inside);
  const float along = (kIce * kIce * cosine - inside) / (kIce * kIce * cosine + inside);
  return 0.5f * (across * across + along * along);
}

}  // namespace

Vec3f facet_place(std::uint32_t particle_id, std::uint32_t number) {
  const std::uint64_t bits = facet_bits(particle_id, number);
  const auto part = [bits](int shift) {
    return (static_cast<float>(bits >> shift & 0x1fffff) + 0.5f) * 0x1p-21f - 0.5f;
  };
  return {part(0), part(21), part(42)};
}

Vec3f facet_normal(std::uint32_t particle_id, std::uint32_t number) {
  const std::uint64_t bits = mix64(facet_bits(particle_id, number));
  const float z = 2 * uniform_float(bits) - 1;
  const Disc flat = on_circle(std::sqrt(std::max(0.f, 1 - z * z)), uniform_float(bits << 32));
  return {flat.x, flat.y, z};
}

struct Sparkle::Query {
  Vec3f p, normal, half;
  float chord2_of_light, footprint;
  float reach2;  // m^2, of particles from `middle`
  Vec3f middle;
  float volume = -1, side = 0;  // m^3, m, of the last particle: most are alike
};

Sparkle::Sparkle(const RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks)
    : grid_(grid), snapshot_(snapshot), layer_(0.5f * static_cast<float>(grid.spacing())) {
  looks_.reserve(looks.size());
  for (const SnowLook& look : looks) {
    const SparkleSettings& s = look.sparkle;
    const double sine = portable_sincos(0.5 * s.roughness * 3.14159265358979323846 / 180).sin;
    looks_.push_back({static_cast<float>(s.density / layer_),
                      static_cast<float>(s.strength * kPi * s.size * s.size), static_cast<float>(s.size),
                      static_cast<float>(4 * sine * sine)});
  }
}

bool Sparkle::any() const {
  return std::any_of(looks_.begin(), looks_.end(), [](const Look& l) { return l.per_volume * l.area > 0; });
}

// Sum over a particle's facets of area share times cone share, 1/sr. A facet counts by its depth as well, in
// full half a spacing deep and not at all at the surface and one spacing deep, so that none comes at once.
float Sparkle::add_particle(std::uint32_t sorted, Query& query) const {
  const std::uint32_t particle = grid_.snapshot_index(sorted);
  const Look& look = looks_[std::min<std::size_t>(snapshot_.object[particle], looks_.size() - 1)];
  const std::uint32_t id = snapshot_.id[particle];
  const float volume = snapshot_.volume0[particle];
  const float standing_for = volume * look.per_volume, most = std::min(standing_for, kMostFacets);
  const auto facets =
      static_cast<std::uint32_t>(most + uniform_float(mix64(~static_cast<std::uint64_t>(id))));
  if (facets == 0) return 0;
  const float larger = standing_for / most, area = look.area * larger;
  const float seen = std::min(std::max(look.size * std::sqrt(larger), query.footprint), layer_);
  const float chord2 = look.chord2 + query.chord2_of_light;

  const Eigen::Matrix3f back =
      unpack_rotation({snapshot_.turn[0][particle], snapshot_.turn[1][particle], snapshot_.turn[2][particle]})
          .transpose();
  const Vec3f p = back * (query.p - grid_.center(sorted)), normal = back * query.normal,
              half = back * query.half;
  if (volume != query.volume) {
    query.volume = volume;
    query.side = static_cast<float>(portable_cbrt(volume));
  }
  float sum = 0;
  for (std::uint32_t k = 0; k < facets; ++k) {
    const Vec3f from = query.side * facet_place(id, k) - p;
    const float depth = -from.dot(normal), by_depth = 1 - std::fabs(depth / layer_ - 1);
    if (by_depth <= 0 || from.squaredNorm() - depth * depth > seen * seen) continue;
    const Vec3f facet = facet_normal(id, k);
    const Vec3f off = facet.dot(half) < 0 ? Vec3f(facet + half) : Vec3f(facet - half);
    sum += by_depth * std::max(0.f, 2 - 2 * off.squaredNorm() / chord2);
  }
  return sum * area / (kPi * seen * seen) / (kPi * chord2);
}

float Sparkle::brdf(const Vec3f& p, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi, float light_cone,
                    float footprint) const {
  const float cos_o = wo.dot(normal), cos_i = wi.dot(normal);
  if (looks_.empty() || !(cos_o > 0 && cos_i > 0)) return 0;
  const Vec3f half = (wo + wi).normalized();
  const float reach = 1.42f * layer_ + 0.87f * static_cast<float>(grid_.spacing());
  Query query{
      p, normal, half, 0.25f * light_cone * light_cone, footprint, reach * reach, p - layer_ * normal};
  const kernels::TraceGrid& view = grid_.view();
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    const auto top = static_cast<float>(view.cells[a]);
    low[a] = static_cast<int>(std::clamp((query.middle[a] - reach) * view.inv_cell, 0.f, top));
    high[a] = static_cast<int>(std::clamp((query.middle[a] + reach) * view.inv_cell, -1.f, top - 1));
  }
  float sum = 0;
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const std::size_t cell = cell_index(view, x, y, z);
        if (cell == kNoCell) continue;
        for (std::uint32_t s = view.cell_start[cell]; s < view.cell_start[cell + 1]; ++s) {
          if ((grid_.center(s) - query.middle).squaredNorm() < query.reach2) sum += add_particle(s, query);
        }
      }
    }
  }
  const float cos_n = half.dot(normal), cos_d = wo.dot(half);
  const float shadowing = std::min(1.f, 2 * cos_n * std::min(cos_o, cos_i) / cos_d);  // of V-shaped grooves
  return fresnel(cos_d) * shadowing * sum / (4 * cos_o * cos_i);
}

}  // namespace firn
