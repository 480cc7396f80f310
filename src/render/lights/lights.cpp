// SPDX-License-Identifier: MIT
#include "src/render/lights/lights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "src/core/infinity.h"
#include "src/core/portable_math.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

constexpr double kNarrowest = 1e-7;  // 1 - cos of a sun's radius: 0.026 degrees, so that rays can hit it

float power_of(const Lamp& lamp) {
  return std::visit([](const auto& one) { return kPi * one.area * one.strength; }, lamp);
}

Vec3f direction_of(const kernels::DistantSun& sun) { return Eigen::Map<const Vec3f>(sun.direction); }

// By 2 - 2 cos of the angle between them, without cancellation.
bool shines_from(const kernels::DistantSun& sun, const Vec3f& d) {
  return (d - direction_of(sun)).squaredNorm() <= 2 * sun.spread;
}

// Of what an even sky's light would have it sampled by, where there is a sun too.
constexpr float kSkyBesideSun = 0.15f;

}  // namespace

LightSet::LightSet(const std::vector<Light>& lights, const ObjectSet& objects)
    : objects_(objects), lamp_of_object_(objects.count(), -1), sky_(lights) {
  for (const Light& light : lights) {
    if (const auto* quad = std::get_if<QuadLight>(&light)) lamps_.emplace_back(QuadLamp(*quad));
    if (const auto* ball = std::get_if<SphereLight>(&light)) lamps_.emplace_back(BallLamp(*ball));
    if (const auto* sun = std::get_if<SunLight>(&light)) add_sun(*sun);
  }
  for (int i = 0; i < objects.count(); ++i) {
    if (objects.surface(i).kind != SurfaceKind::emission) continue;
    lamp_of_object_[i] = static_cast<int>(lamps_.size());
    lamps_.emplace_back(ObjectLamp(objects.area(i), objects.surface(i).emission));
  }
  // Rays find an even sky by themselves; a sun they do not.
  const bool even = std::none_of(lights.begin(), lights.end(), [](const Light& light) {
    return std::holds_alternative<ImageLight>(light);
  });
  sky_strength_ = sky_.strength() * (even && !suns_.empty() ? kSkyBesideSun : 1);
  distant_strength_ = sky_strength_;
  for (const auto& sun : suns_) distant_strength_ += sun.strength;
}

// A disc of uniform radiance L and angular radius a sends pi L sin^2 a to a plane that faces it.
void LightSet::add_sun(const SunLight& light) {
  const SinCos half = portable_sincos(0.5 * light.angular_radius * 3.14159265358979323846 / 180);
  const double spread = std::max(2 * half.sin * half.sin, kNarrowest), pi = 3.14159265358979323846;
  const Vec3f radiance = light.irradiance / static_cast<float>(spread * (2 - spread) * pi);
  const Vec3f direction = light.direction.normalized().cast<float>();
  sun_radiance_.push_back(radiance);
  kernels::DistantSun& sun = suns_.emplace_back();
  sun.spread = static_cast<float>(spread);
  sun.strength = static_cast<float>(radiance.sum() * 2 * pi * spread);
  Eigen::Map<Vec3f>(sun.direction) = direction;
  Eigen::Map<Vec3f>(sun.side) = around(direction, 1, 0, 0);
  Eigen::Map<Vec3f>(sun.up) = around(direction, 0, 1, 0);
}

void LightSet::place(const Vec3& origin, const Vec3& center, float radius) {
  center_ = center.cast<float>(), radius_ = radius;
  for (Lamp& lamp : lamps_) {
    if (auto* quad = std::get_if<QuadLamp>(&lamp)) quad->place(origin);
    if (auto* ball = std::get_if<BallLamp>(&lamp)) ball->place(origin);
  }
  for (int i = 0; i < objects_.count(); ++i) {
    if (lamp_of_object_[i] < 0) continue;
    std::get<ObjectLamp>(lamps_[lamp_of_object_[i]]).place(objects_.pose(i), objects_.shape(i), center);
  }
  total_power_ = kPi * radius * radius * distant_strength_;
  for (const Lamp& lamp : lamps_) total_power_ += power_of(lamp);
}

float LightSet::weight(int lamp, const Vec3f& p) const {
  return std::visit([&p](const auto& one) { return one.weight(p); }, lamps_[lamp]);
}

float LightSet::total_weight(const Vec3f& p) const {
  float total = distant_strength_;
  for (int i = 0; i < distant(); ++i) total += weight(i, p);
  return total;
}

bool LightSet::sample(const Vec3f& p, float choice, Sample2 at, LightSample& out) const {
  const float total = total_weight(p);
  if (!(total > 0)) return false;
  float left = choice * total;
  for (int i = 0; i < distant(); ++i) {
    const float chance = weight(i, p);
    if (left < chance) return sample_lamp(i, chance / total, p, at, out);
    left -= chance;
  }
  if (!(distant_strength_ > 0)) return false;
  out.direction = distant_direction(left, at);
  out.distance = kInfinity;
  out.radiance = background(out.direction);
  const float density = distant_density(out.direction);
  out.pdf = density / total;
  out.pdf_emit = crosses_disc(p, out.direction) ? density / total_power_ : 0;
  out.cosine = 1;
  return out.pdf > 0;
}

void LightSet::aim(const kernels::ShadeKernels& with, const float* choice, const float* u, const float* v,
                   RayStream& rays) const {
  float* const direction[3] = {rays.directions(0), rays.directions(1), rays.directions(2)};
  if (lamps_.empty() && distant_strength_ > 0) {
    const kernels::DistantLights lights{suns_.data(), suns_.size(), sky_.table(), distant_strength_};
    with.distant_directions(lights, choice, u, v, 0, rays.size(), direction);
    for (std::size_t i = 0; i < rays.size(); ++i) rays.t(i) = kInfinity;
    return;
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    LightSample light;
    const bool seen = sample(rays.origin(i), choice[i], {u[i], v[i]}, light);
    rays.t(i) = seen ? light.distance : 0;
    const Vec3f to = seen ? light.direction : Vec3f::UnitZ();
    for (int a = 0; a < 3; ++a) direction[a][i] = to[a];
  }
}

bool LightSet::sample_lamp(int lamp, float chance, const Vec3f& p, Sample2 at, LightSample& out) const {
  LampSight sight;
  if (!std::visit([&](const auto& one) { return one.toward(p, at, sight); }, lamps_[lamp])) return false;
  const LightHit hit = lamp_hit(lamp, sight.cosine);
  out = {sight.direction, sight.distance, hit.radiance, chance * sight.pdf, hit.pdf_emit, sight.cosine};
  return true;
}

bool LightSet::middle(int beacon, const Vec3f& p, LightSample& out) const {
  if (beacon >= distant()) {
    const int which = beacon - distant();
    const float density = 1 / (2 * kPi * suns_[which].spread);
    out = {direction_of(suns_[which]), kInfinity, sun_radiance_[which], density, 0, 1};
    return true;
  }
  // A ball's cone is sampled from its axis on, all others from a corner.
  const bool ball = std::holds_alternative<BallLamp>(lamps_[beacon]);
  return sample_lamp(beacon, 1, p, ball ? Sample2{0, 0} : Sample2{0.5f, 0.5f}, out);
}

// Light leaves a lamp with density cosine / pi.
LightHit LightSet::lamp_hit(int lamp, float cosine) const {
  return std::visit(
      [&](const auto& one) {
        return LightHit{lamp, one.radiance, one.strength * cosine / total_power_, cosine};
      },
      lamps_[lamp]);
}

float LightSet::pdf(const Vec3f& p, const Vec3f& direction, float distance, const LightHit& hit) const {
  const float total = total_weight(p);
  if (!(total > 0)) return 0;
  if (hit.light == distant()) return distant_density(direction) / total;
  if (!(hit.pdf_emit > 0)) return 0;  // the side of an object that is not sampled
  const float density =
      std::visit([&](const auto& one) { return one.density(p, distance, hit.cosine); }, lamps_[hit.light]);
  return weight(hit.light, p) / total * density;
}

bool LightSet::emit(float choice, Sample2 place, Sample2 direction, Emission& out) const {
  if (!(total_power_ > 0)) return false;
  float left = choice * total_power_;
  for (int i = 0; i < distant(); ++i) {
    const float power = power_of(lamps_[i]);
    if (!(power > 0)) continue;
    if (left < power) {
      emit_lamp(i, place, direction, out);
      return true;
    }
    left -= power;
  }
  if (!(distant_strength_ > 0)) return false;
  const Vec3f towards = distant_direction(left / (kPi * radius_ * radius_), direction);
  const float density = distant_density(towards);
  const Disc disc = on_circle(radius_ * std::sqrt(place.u), place.v);
  out.origin = center_ + around(towards, disc.x, disc.y, radius_);
  out.direction = -towards;
  out.radiance = background(towards);
  out.pdf_emit = density / total_power_;
  out.pdf_start = out.pdf_emit * kPi * radius_ * radius_;
  out.cosine = 1;
  out.light = distant();
  out.distant = true;
  return out.pdf_emit > 0;
}

void LightSet::emit_lamp(int lamp, Sample2 place, Sample2 direction, Emission& out) const {
  const LampPoint point = std::visit([&](const auto& one) { return one.point(place); }, lamps_[lamp]);
  out.origin = point.p;
  out.direction = cosine_direction(point.normal, direction);
  out.cosine = std::max(out.direction.dot(point.normal), 0.f);
  const LightHit hit = lamp_hit(lamp, out.cosine);
  out.radiance = hit.radiance;
  out.pdf_emit = hit.pdf_emit;
  out.pdf_start = std::visit([](const auto& one) { return one.strength * kPi; }, lamps_[lamp]) / total_power_;
  out.light = lamp;
  out.distant = false;
}

bool LightSet::hit(const Vec3f& o, const Vec3f& d, float& t, LightHit& out) const {
  int met = -1;
  float cosine = 0;
  for (int i = 0; i < distant(); ++i) {
    if (std::visit([&](const auto& one) { return one.hit(o, d, t, cosine); }, lamps_[i])) met = i;
  }
  if (met >= 0) out = lamp_hit(met, cosine);
  return met >= 0;
}

bool LightSet::object_hit(int object, const Vec3f& d, const ObjectHit& met, LightHit& out) const {
  const int lamp = lamp_of_object_[object];
  if (lamp < 0) return false;
  const float facing = -d.dot(met.normal);
  out = lamp_hit(lamp, std::fabs(facing));
  const auto& glow = std::get<ObjectLamp>(lamps_[lamp]);
  if (!(glow.area > 0) || (facing < 0) != glow.inward()) out.pdf_emit = 0;
  return true;
}

LightHit LightSet::escape(const Vec3f& o, const Vec3f& d) const {
  const bool reached = total_power_ > 0 && crosses_disc(o, d);
  return {distant(), background(d), reached ? distant_density(d) / total_power_ : 0, 1};
}

bool LightSet::crosses_disc(const Vec3f& o, const Vec3f& d) const {
  const Vec3f to = center_ - o;
  return (to - to.dot(d) * d).squaredNorm() <= radius_ * radius_;
}

Vec3f LightSet::background(const Vec3f& d) const {
  Vec3f sum = sky_.radiance(d);
  for (std::size_t i = 0; i < suns_.size(); ++i) {
    if (shines_from(suns_[i], d)) sum += sun_radiance_[i];
  }
  return sum;
}

float LightSet::distant_density(const Vec3f& d) const {
  float sum = sky_strength_ * sky_.density(d);
  for (const auto& sun : suns_) {
    if (shines_from(sun, d)) sum += sun.strength / (2 * kPi * sun.spread);
  }
  return sum;
}

Vec3f LightSet::distant_direction(float left, Sample2 at) const {
  for (const auto& sun : suns_) {
    if (left < sun.strength) return cone_direction(direction_of(sun), sun.spread, at);
    left -= sun.strength;
  }
  return sky_.strength() > 0 ? sky_.sample(at)
                             : cone_direction(direction_of(suns_.back()), suns_.back().spread, at);
}

bool LightSet::may_reach(const Vec3f& low, const Vec3f& high) const {
  const Box3f room(low, high);
  return std::any_of(lamps_.begin(), lamps_.end(), [&](const Lamp& lamp) {
    return std::visit([&](const auto& one) { return one.box().intersects(room); }, lamp);
  });
}

}  // namespace firn
