// SPDX-License-Identifier: MIT
#include "src/render/snow/sparkle.h"

#include <algorithm>
#include <cmath>

#include "src/core/portable_math.h"
#include "src/core/rotation.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

constexpr float kIce = 1.31f;        // refractive index in the middle of the visible
constexpr float kWidest = 4;         // light cones, in cones of a facet, that single facets are seen in
constexpr float kLargestSpread = 1;  // of a facet over a footprint, in cells of the field

// Reflectance of a flat side of ice, unpolarised.
float fresnel(float cosine) {
  const float inside = std::sqrt(kIce * kIce - 1 + cosine * cosine);
  const float across = (cosine - inside) / (cosine + inside);
  const float along = (kIce * kIce * cosine - inside) / (kIce * kIce * cosine + inside);
  return 0.5f * (across * across + along * along);
}

// How much of a disc of radius `light` lies in one of radius `facet` whose centre is `apart` from its own.
float shared(float apart, float facet, float light) {
  if (apart >= facet + light) return 0;
  if (apart <= facet - light) return 1;
  const double d = apart, a = facet, b = light;
  if (d <= b - a) return static_cast<float>(a * a / (b * b));
  const double x = (d * d + b * b - a * a) / (2 * d * b), y = (d * d + a * a - b * b) / (2 * d * a);
  const double corner = 0.5 * std::sqrt(std::max(0., 4 * d * d * b * b - 4 * x * x * d * d * b * b));
  return static_cast<float>((portable_acos(x) + (a * a * portable_acos(y) - corner) / (b * b)) / kPi);
}

}  // namespace

struct Sparkle::Shine {
  Shine(const Vec3f& normal, const Vec3f& wo, const Vec3f& wi) {
    const float cos_o = wo.dot(normal), cos_i = wi.dot(normal);
    if (!(cos_o > 0 && cos_i > 0)) return;
    half = (wo + wi).normalized();
    factor = fresnel(wo.dot(half)) / (2 * (cos_i + cos_o));
  }
  Vec3f half = Vec3f::Zero();
  float factor = 0;
};

Sparkle::Sparkle(const RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks)
    : grid_(grid), snapshot_(snapshot) {
  for (const SnowLook& look : looks) {
    const double half_angle = 0.5 * look.sparkle.roughness * 3.14159265358979323846 / 180;
    looks_.push_back({FacetField(look.sparkle), static_cast<float>(2 * portable_sincos(half_angle).sin),
                      static_cast<float>(look.sparkle.strength)});
  }
}

bool Sparkle::any() const {
  return std::any_of(looks_.begin(), looks_.end(),
                     [](const Look& l) { return l.facets.coverage() * l.strength > 0; });
}

const Sparkle::Look& Sparkle::look_of(std::uint32_t particle) const {
  return looks_[std::min<std::size_t>(snapshot_.object[particle], looks_.size() - 1)];
}

kernels::FacetCells Sparkle::cells(std::size_t object) const {
  const Look& look = looks_[std::min(object, looks_.size() - 1)];
  return look.facets.cells(look.chord, kLargestSpread * look.facets.cell());
}

float Sparkle::mean_brdf(std::uint32_t sorted, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi) const {
  const Look& look = look_of(grid_.snapshot_index(sorted));
  return look.strength * look.facets.coverage() / (2 * kPi) * Shine(normal, wo, wi).factor;
}

float Sparkle::brdf(std::uint32_t sorted, const Vec3f& p, const Vec3f& normal, const Vec3f& wo,
                    const Vec3f& wi, float light_cone, float footprint) const {
  const Look& look = look_of(grid_.snapshot_index(sorted));
  if (!(look.strength * look.facets.coverage() > 0)) return 0;
  const float light_chord = 0.5f * light_cone;  // half vectors turn by half as much
  if (light_chord > kWidest * look.chord) return mean_brdf(sorted, normal, wo, wi);
  const Shine shine(normal, wo, wi);
  if (!(shine.factor > 0)) return 0;
  return look.strength * shine.factor * glints(look, sorted, p, normal, shine.half, light_chord, footprint);
}

// D, 1/sr. A facet is the ellipsoid that its ball becomes when it is spread over the footprint, along the
// surface alone.
float Sparkle::glints(const Look& look, std::uint32_t sorted, const Vec3f& p, const Vec3f& normal,
                      const Vec3f& half, float light_chord, float footprint) const {
  const std::uint32_t particle = grid_.snapshot_index(sorted);
  const Eigen::Matrix3f back =
      unpack_rotation(
          {snapshot_.rotation[0][particle], snapshot_.rotation[1][particle], snapshot_.rotation[2][particle]})
          .transpose();
  const Vec3f at = back * (p - grid_.center(sorted)), n = back * normal, h = back * half;
  const float deep = look.facets.radius();
  const float wide = std::max(std::min(footprint, kLargestSpread * look.facets.cell()), deep);
  const float shrunk = (deep / wide) * (deep / wide);
  Vec3f box;
  for (int a = 0; a < 3; ++a)
    box[a] = std::sqrt(wide * wide * std::max(0.f, 1 - n[a] * n[a]) + deep * deep * n[a] * n[a]);
  float sum = 0;
  const float reach = look.chord + light_chord;
  look.facets.near(snapshot_.id[particle], at, box, h, reach, [&](const Vec3f& place, const Vec3f& facet) {
    const float apart2 = (facet - h).squaredNorm();
    if (apart2 >= reach * reach) return;
    const Vec3f off = place - at;
    const float depth = off.dot(n), aside2 = off.squaredNorm() - depth * depth;
    if (aside2 * shrunk + depth * depth >= deep * deep) return;
    sum += shared(std::sqrt(apart2), look.chord, light_chord);
  });
  return sum * shrunk / (kPi * look.chord * look.chord);
}

}  // namespace firn
