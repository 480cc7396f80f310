// SPDX-License-Identifier: MIT
// The preview's light: how much snow lies about each point, and what that makes of the lights.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "src/render/preview/preview.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

// Cells below a point at which its column is probed, and how much of it each probe stands for.
constexpr float kBelow[] = {0.7f, 2.1f, 4.2f, 8.4f, 16.8f, 33.6f};
constexpr float kStands[] = {1.4f, 1.4f, 2.8f, 5.6f, 11.2f, 22.4f};
constexpr int kHalvings = 2;
constexpr float kEnds = 0.2f;  // of the density as placed: there is no snow any more
constexpr float kDeep = 300;   // transport depths: below them nothing changes (T < 0.5 %)
// Cells before a point, and how much of the sky snow there would hide.
constexpr float kBefore[] = {2, 4, 8};
constexpr float kHides[] = {0.3f, 0.25f, 0.2f};
constexpr float kSoftest = 0.5f, kMostLift = 3;  // cosine; spacings
constexpr float kFaintest = 1e-3f;               // of light that passes a layer

// max(cosine, 0), but round between -soft and soft.
float ramp(float cosine, float soft) {
  if (cosine >= soft) return cosine;
  return cosine <= -soft ? 0 : (cosine + soft) * (cosine + soft) / (4 * soft);
}

// Half the angle that a light fills, as a disc.
float cone_of(const LightSample& light) { return 1 / std::sqrt(kPi * light.pdf); }

}  // namespace

void PreviewTile::probe() {
  const std::size_t count = points_.size();
  density_.resize(count);
  for (int a = 0; a < 3; ++a) {
    for (auto* column : {&probe_from_[a], &probe_down_[a], &probe_up_[a]}) column->resize(count);
    for (std::size_t k = 0; k < count; ++k) {
      probe_from_[a][k] = points_[k].p[a];
      probe_up_[a][k] = points_[k].smooth[a];
      probe_down_[a][k] = -points_[k].smooth[a];
    }
  }
  measure_openings();
  measure_columns();
}

// From probe to probe deeper, until all columns have ended or are deep; those that go on move up.
void PreviewTile::measure_columns() {
  const float cell = view_.grid.view().cell;
  const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                  {probe_down_[0].data(), probe_down_[1].data(), probe_down_[2].data()}};
  std::size_t left = 0;
  const auto keep = [&](std::size_t from, std::uint32_t point) {
    for (int a = 0; a < 3 && left < from; ++a) {
      probe_from_[a][left] = probe_from_[a][from];
      probe_down_[a][left] = probe_down_[a][from];
    }
    open_[left++] = point;
  };
  open_.resize(points_.size()), ends_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (points_[k].snow()) keep(k, static_cast<std::uint32_t>(k));
  }
  float done = 0;  // cells that the probes before stand for
  for (std::size_t step = 0; step < std::size(kBelow) && left > 0; ++step) {
    const std::size_t count = std::exchange(left, 0);
    view_.field.probe_density(probes, kBelow[step] * cell, count, density_.data());
    for (std::size_t k = 0; k < count; ++k) {
      Point& point = points_[open_[k]];
      if (!(density_[k] > kEnds * point.placed)) {
        ends_.push_back({open_[k], step > 0 ? kBelow[step - 1] : 0, kBelow[step], done});
        continue;
      }
      point.column += density_[k] * kStands[step] * cell;
      if (layers_.transport_depth(point.object, point.column) < kDeep) keep(k, open_[k]);
    }
    done += kStands[step];
  }
  find_ends();
}

// Halves what lies between the last probe in a column and the first beyond it, and mends the column.
void PreviewTile::find_ends() {
  const float cell = view_.grid.view().cell;
  const std::size_t count = ends_.size();
  for (int round = 0; round < kHalvings && count > 0; ++round) {
    for (std::size_t e = 0; e < count; ++e) {
      const Point& point = points_[ends_[e].point];
      const float middle = 0.5f * (ends_[e].within + ends_[e].beyond) * cell;
      for (int a = 0; a < 3; ++a)
        probe_from_[a][e] = point.p[a], probe_down_[a][e] = -middle * point.smooth[a];
    }
    const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                    {probe_down_[0].data(), probe_down_[1].data(), probe_down_[2].data()}};
    view_.field.probe_density(probes, 1, count, density_.data());
    for (std::size_t e = 0; e < count; ++e) {
      End& end = ends_[e];
      const float middle = 0.5f * (end.within + end.beyond);
      (density_[e] > kEnds * points_[end.point].placed ? end.within : end.beyond) = middle;
    }
  }
  for (const End& end : ends_) {
    Point& point = points_[end.point];
    if (!(end.counted > 0)) continue;  // thinner than the first probe is deep
    point.column *= 0.5f * (end.within + end.beyond) / end.counted;
  }
}

void PreviewTile::measure_openings() {
  if (view_.grid.size() == 0) return;
  const float cell = view_.grid.view().cell;
  const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                  {probe_up_[0].data(), probe_up_[1].data(), probe_up_[2].data()}};
  const float full = 1 / static_cast<float>(view_.setup.snow.front().density);
  for (std::size_t step = 0; step < std::size(kBefore); ++step) {
    view_.field.probe_density(probes, kBefore[step] * cell, points_.size(), density_.data());
    for (std::size_t k = 0; k < points_.size(); ++k)
      points_[k].opening -= kHides[step] * std::min(density_[k] * full, 1.f);
  }
}

// What the columns make of the snow at each point.
void PreviewTile::prepare() {
  const auto spacing = static_cast<float>(view_.grid.spacing());
  for (Point& point : points_) {
    if (!point.snow()) continue;
    point.column = std::max(point.column, point.placed * spacing);  // a particle, however torn the snow
    point.layer = layers_.of(point.object, point.column);
    point.surface.albedo = point.layer.reflected;
    // A ball of diameter D passes |cos| / (1 + 3/4 D cos^2 / path): half of that at cos = soft / 2.
    const float depth = std::max(layers_.transport_depth(point.object, point.column), 1.f);
    point.soft = std::min(2 / std::sqrt(0.75f * depth), kSoftest);
    // As deep as light comes in, so that what it softens is not in the snow's own shadow.
    point.lift =
        std::min(spacing + 4.f / 3 * layers_.transport_path(point.object, point.placed), kMostLift * spacing);
  }
}

void PreviewTile::add_ambient() {
  for (const Point& point : points_) {
    const Vec3f& albedo = point.surface.albedo;
    const Vec3f open = point.opening * (Vec3f::Ones() - (1 - point.opening) * albedo).cwiseInverse();
    Vec3f light = ambient_.irradiance(point.surface.normal).cwiseProduct(albedo).cwiseProduct(open) / kPi;
    Vec3f passed = Vec3f::Zero();
    if (point.snow() && point.layer.passed.maxCoeff() > kFaintest)
      passed = ambient_.irradiance(-point.surface.normal).cwiseProduct(point.layer.passed) / kPi;
    FilmSample& seen = pixels_[point.pixel].seen;
    seen.beauty += point.weight.cwiseProduct(light + passed);
    if (point.snow()) seen.subsurface += point.weight.cwiseProduct(passed);
  }
}

bool PreviewTile::may_glint(const Point& point, const Vec3f& direction) const {
  return point.snow() && point.footprint > 0 && point.smooth.dot(direction) > 0 &&
         point.smooth.dot(point.back) > 0 && view_.sparkle.any();
}

Vec3f PreviewTile::glint(const Point& point, const LightSample& light) const {
  const float brdf = view_.sparkle.brdf(point.sorted, point.p, point.smooth, point.back, light.direction,
                                        cone_of(light), point.footprint);
  return light.radiance * (brdf * point.smooth.dot(light.direction) / light.pdf);
}

// False if nothing comes.
bool PreviewTile::bring(const Point& point, Brings& brings) const {
  const LightSample& light = brings.light;
  const Vec3f irradiance = light.radiance * (1 / light.pdf);
  const float cosine = point.surface.normal.dot(light.direction);
  brings.direct = brings.passed = Vec3f::Zero();
  if (!point.snow()) {
    if (!(cosine > 0)) return false;
    brings.direct = evaluate(point.surface, point.back, light.direction).cwiseProduct(irradiance) * cosine;
    return brings.direct.maxCoeff() > 0;
  }
  const float lit = ramp(cosine, point.soft);
  if (lit > 0) brings.direct = point.layer.reflected.cwiseProduct(irradiance) * (lit / kPi);
  const bool passes = cosine < 0 && point.layer.passed.maxCoeff() > kFaintest;
  if (passes) brings.passed = point.layer.passed.cwiseProduct(irradiance) * (-cosine / kPi);
  return lit > 0 || passes || may_glint(point, light.direction);
}

void PreviewTile::cast_shadows(int beacon) {
  const World& world = view_.world;
  shadow_rays_.clear(), brings_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Point& point = points_[k];
    Brings& brings = brings_.emplace_back();
    brings.point = static_cast<std::uint32_t>(k);
    if (!world.lights.middle(beacon, point.p, brings.light) || !bring(point, brings)) {
      brings_.pop_back();
      continue;
    }
    shadow_rays_.push(point.p + point.lift * point.smooth, brings.light.direction,
                      brings.light.distance * (1 - 1e-4f));
  }
  Flights(world).find_shadow(shadow_rays_, true);
  rays_traced_ += shadow_rays_.size();
}

// Which of them come through; drops those that bring nothing then.
void PreviewTile::find_lit() {
  std::size_t left = 0;
  for (std::size_t ray = 0; ray < brings_.size(); ++ray) {
    Brings& brings = brings_[ray];
    const bool snow = shadow_rays_.hit(ray) != kernels::kNoHit;
    if (snow && !(brings.passed.maxCoeff() > 0)) continue;
    if (!bare_) {
      const Vec3f o = shadow_rays_.origin(ray), d = shadow_rays_.direction(ray);
      float reach = shadow_rays_.t(ray);
      LightHit lamp;
      if (view_.world.lights.hit(o, d, reach, lamp) || view_.world.objects.occluded(o, d, reach)) continue;
    }
    brings.sunlit = !snow;
    brings_[left++] = brings;
  }
  brings_.resize(left);
}

// Asks all at once which of those that are lit may glint.
void PreviewTile::find_glints() {
  snow_.clear();
  for (std::size_t b = 0; b < brings_.size(); ++b) {
    const Brings& brings = brings_[b];
    if (brings.sunlit && may_glint(points_[brings.point], brings.light.direction))
      snow_.push_back(static_cast<std::uint32_t>(b));
  }
  const std::size_t count = snow_.size();
  for (auto* columns : {&local_, &smooth_, &back_, &light_}) columns->resize(count);
  for (auto* column : {&light_chord_, &footprint_}) column->resize(count);
  for (auto& column : turn_) column.resize(count);
  id_.resize(count), glints_.resize(count);
  for (std::size_t s = 0; s < count; ++s) {
    const Brings& brings = brings_[snow_[s]];
    const Point& point = points_[brings.point];
    const std::uint32_t particle = view_.grid.snapshot_index(point.sorted);
    id_[s] = view_.snapshot.id[particle];
    for (int a = 0; a < 3; ++a) turn_[a][s] = view_.snapshot.turn[a][particle];
    local_.set(s, point.p - view_.grid.center(point.sorted));
    smooth_.set(s, point.smooth), back_.set(s, point.back), light_.set(s, brings.light.direction);
    light_chord_[s] = 0.5f * cone_of(brings.light);
    footprint_[s] = point.footprint;
  }
  const kernels::GlintView glints{id_.data(),          {turn_[0].data(), turn_[1].data(), turn_[2].data()},
                                  local_.view(),       smooth_.view(),
                                  back_.view(),        light_.view(),
                                  light_chord_.data(), footprint_.data()};
  const auto object = [&](std::size_t s) { return points_[brings_[snow_[s]].point].object; };
  for (std::size_t begin = 0, end; begin < count; begin = end) {  // runs of one kind of snow
    for (end = begin + 1; end < count && object(end) == object(begin);) ++end;
    view_.shade.may_glint(view_.sparkle.cells(object(begin)), glints, begin, end, glints_.data());
  }
  for (std::size_t s = 0; s < count; ++s) brings_[snow_[s]].glints = glints_[s] != 0;
}

void PreviewTile::add_lit() {
  for (const Brings& brings : brings_) {
    const Point& point = points_[brings.point];
    FilmSample& seen = pixels_[point.pixel].seen;
    const Vec3f passed = point.weight.cwiseProduct(brings.passed);
    seen.subsurface += passed;
    seen.beauty += passed;
    if (!brings.sunlit) continue;
    seen.beauty += point.weight.cwiseProduct(brings.direct);
    if (!brings.glints) continue;
    const Vec3f sparkle = point.weight.cwiseProduct(glint(point, brings.light));
    seen.sparkle += sparkle;
    seen.beauty += sparkle;
  }
}

}  // namespace firn
