// SPDX-License-Identifier: MIT
#include "src/render/preview/ambient.h"

#include <algorithm>
#include <cmath>

#include "src/core/infinity.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

constexpr int kDirections = 1024;

// Even over the sphere: a spiral by the golden angle.
Vec3f spiral(int k) {
  const float z = 1 - 2 * (static_cast<float>(k) + 0.5f) / kDirections;
  const double turn = 0.61803398874989485 * k;
  const Disc disc = on_circle(std::sqrt(1 - z * z), static_cast<float>(turn - std::floor(turn)));
  return {disc.x, z, disc.y};
}

// Real harmonics up to order 2.
std::array<float, 9> harmonics(const Vec3f& d) {
  const float x = d.x(), y = d.y(), z = d.z();
  return {0.282095f,
          0.488603f * y,
          0.488603f * z,
          0.488603f * x,
          1.092548f * x * y,
          1.092548f * y * z,
          1.092548f * x * z,
          0.546274f * (x * x - y * y),
          0.315392f * (3 * z * z - 1)};
}

// Whether light comes from there unhindered by objects and snow.
bool open(const World& world, const Vec3f& p, const LightSample& light) {
  const float reach = light.distance * (1 - 1e-4f);
  if (world.objects.occluded(p, light.direction, reach)) return false;
  RayStream ray;
  ray.push(p, light.direction, reach);
  Flights(world).find_shadow(ray);
  return ray.hit(0) == kernels::kNoHit;
}

}  // namespace

template <class Radiance>
AmbientLight::Harmonics AmbientLight::project(Radiance&& radiance) {
  Harmonics sum;
  sum.fill(Vec3f::Zero());
  for (int k = 0; k < kDirections; ++k) {
    const Vec3f d = spiral(k), light = radiance(d);
    const auto basis = harmonics(d);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += basis[i] * light;
  }
  for (Vec3f& each : sum) each *= 4 * kPi / kDirections;
  return sum;
}

AmbientLight::AmbientLight(const LightSet& lights)
    : sky_(lobes_of(project([&lights](const Vec3f& d) { return lights.sky(d); }))), lobes_(sky_) {}

void AmbientLight::look_around(const World& world, const Vec3f& p) {
  lobes_ = sky_;
  if (!world.objects.empty()) lobes_ = lobes_of(project([&](const Vec3f& d) { return seen(world, p, d); }));
}

// Lamps light by themselves; here they are dark.
Vec3f AmbientLight::seen(const World& world, const Vec3f& p, const Vec3f& d) const {
  float reach = kInfinity;
  const ObjectHit hit = world.objects.closest(p, d, reach);
  if (hit.object >= 0) reach = hit.t;
  LightHit light;
  if (world.lights.hit(p, d, reach, light)) return Vec3f::Zero();
  if (hit.object < 0) return world.lights.sky(d);
  if (world.lights.object_hit(hit.object, d, hit, light))
    return light.pdf_emit > 0 ? Vec3f::Zero() : light.radiance;
  const SurfacePoint surface = world.objects.point(hit);
  if (surface.kind == SurfaceKind::mirror)
    return surface.albedo.cwiseProduct(world.lights.sky(d - 2 * d.dot(surface.normal) * surface.normal));
  if (is_specular(surface)) return world.lights.sky(d);
  const Vec3f normal = surface.normal.dot(d) < 0 ? surface.normal : Vec3f(-surface.normal);
  const Vec3f at = p + hit.t * d + 1e-5f * hit.t * normal;
  Vec3f sum = irradiance_of(sky_, normal);
  for (int k = 0; k < world.lights.beacons(); ++k) {
    LightSample sample;
    if (!world.lights.middle(k, at, sample)) continue;
    const float cosine = normal.dot(sample.direction);
    if (cosine > 0 && open(world, at, sample)) sum += sample.radiance * (cosine / sample.pdf);
  }
  return surface.albedo.cwiseProduct(sum) / kPi;
}

// pi, 2/3 pi and 1/4 pi of the orders.
AmbientLight::Lobes AmbientLight::lobes_of(const Harmonics& light) {
  Lobes lobes;
  for (std::size_t i = 0; i < light.size(); ++i) {
    const float left = i == 0 ? kPi : i < 4 ? 2.f / 3 * kPi : 0.25f * kPi;
    lobes[i] << left * light[i].array(), 0;
  }
  return lobes;
}

Vec3f AmbientLight::irradiance_of(const Lobes& light, const Vec3f& n) {
  const auto basis = harmonics(n);
  Eigen::Array4f sum = basis[0] * light[0];
  for (std::size_t i = 1; i < basis.size(); ++i) sum += basis[i] * light[i];
  return sum.max(0.f).head<3>().matrix();
}

}  // namespace firn
