// SPDX-License-Identifier: MIT
// The preview's light: what the snow about each point makes of the lights.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "src/render/preview/preview.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

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

// What the columns make of the snow at each point.
void PreviewTile::prepare() {
  const auto spacing = static_cast<float>(view_.grid.spacing());
  for (Group& group : groups_) {
    const Point& first = points_[group.first];
    if (!first.snow()) continue;
    group.column = std::max(group.column, group.placed * spacing);  // a particle, however torn the snow
    group.layer = layers_.of(first.object, group.column);
    // A ball of diameter D passes |cos| / (1 + 3/4 D cos^2 / path): half of that at cos = soft / 2.
    const float depth = std::max(layers_.transport_depth(first.object, group.column), 1.f);
    group.soft = std::min(2 / std::sqrt(0.75f * depth), kSoftest);
    // As deep as light comes in, so that what it softens is not in the snow's own shadow.
    group.lift =
        std::min(spacing + 4.f / 3 * layers_.transport_path(first.object, group.placed), kMostLift * spacing);
    for (std::uint32_t k = group.first; k < group.first + group.size; ++k) {
      points_[k].surface.albedo = group.layer.reflected;
      points_[k].lift = group.lift;
    }
  }
}

void PreviewTile::add_ambient() {
  for (const Group& group : groups_) {
    const bool snow = points_[group.first].snow();
    const bool passes = snow && group.layer.passed.maxCoeff() > kFaintest;
    for (std::uint32_t k = group.first; k < group.first + group.size; ++k) {
      const Point& point = points_[k];
      const Vec3f& albedo = point.surface.albedo;
      const Vec3f open = group.opening * (Vec3f::Ones() - (1 - group.opening) * albedo).cwiseInverse();
      Vec3f light = ambient_.irradiance(point.surface.normal).cwiseProduct(albedo).cwiseProduct(open) / kPi;
      if (passes) {
        const Vec3f passed =
            ambient_.irradiance(-point.surface.normal).cwiseProduct(group.layer.passed) / kPi;
        light += passed;
        if (!layered_.empty()) layered_[point.pixel].subsurface += point.weight.cwiseProduct(passed);
      }
      beauty_[point.pixel] += point.weight.cwiseProduct(light);
    }
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
  const Group& group = group_of(point);
  const float lit = ramp(cosine, group.soft);
  if (lit > 0) brings.direct = group.layer.reflected.cwiseProduct(irradiance) * (lit / kPi);
  const bool passes = cosine < 0 && group.layer.passed.maxCoeff() > kFaintest;
  if (passes) brings.passed = group.layer.passed.cwiseProduct(irradiance) * (-cosine / kPi);
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

// Brings those of `snow_` of one kind of snow, and of one particle, together, as good as: by a hash. Points
// of one particle ask for much the same facets.
void PreviewTile::gather_particles() {
  constexpr std::uint32_t kKinds = 4, kHashes = 64;
  std::uint32_t next[kKinds * kHashes + 1] = {};
  const auto bucket_of = [&](std::uint32_t b) {
    const Point& point = points_[brings_[b].point];
    return point.object % kKinds * kHashes + (point.sorted * 0x9e3779b1u) / ((1u << 31) / kHashes * 2);
  };
  for (const std::uint32_t b : snow_) ++next[bucket_of(b) + 1];
  std::partial_sum(std::begin(next), std::end(next), std::begin(next));
  gathered_.resize(snow_.size());
  for (const std::uint32_t b : snow_) gathered_[next[bucket_of(b)]++] = b;
  snow_.swap(gathered_);
}

// Asks all at once which of those that are lit may glint.
void PreviewTile::find_glints() {
  snow_.clear();
  for (std::size_t b = 0; b < brings_.size(); ++b) {
    const Brings& brings = brings_[b];
    if (brings.sunlit && may_glint(points_[brings.point], brings.light.direction))
      snow_.push_back(static_cast<std::uint32_t>(b));
  }
  gather_particles();
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
    for (int a = 0; a < 3; ++a) turn_[a][s] = view_.snapshot.rotation[a][particle];
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
    Vec3f& beauty = beauty_[point.pixel];
    const Vec3f passed = point.weight.cwiseProduct(brings.passed);
    beauty += passed;
    if (!layered_.empty()) layered_[point.pixel].subsurface += passed;
    if (!brings.sunlit) continue;
    beauty += point.weight.cwiseProduct(brings.direct);
    if (!brings.glints) continue;
    const Vec3f sparkle = point.weight.cwiseProduct(glint(point, brings.light));
    beauty += sparkle;
    if (!layered_.empty()) layered_[point.pixel].sparkle += sparkle;
  }
}

}  // namespace firn
