// SPDX-License-Identifier: MIT
// How much snow lies below and before the points of a tile. Both change over cells, and points of
// neighbouring pixels are mostly nearer to one another than that: those of 2 x 2 pixels that are alike are
// measured as one.
#include <algorithm>
#include <utility>

#include "src/render/preview/preview.h"

namespace firn {
namespace {

constexpr std::uint32_t kNeighbours = 4;            // pixels in a row of the stream
constexpr float kNear = 0.5f, kLikeNormals = 0.9f;  // cells; cosine
// Cells below a point at which its column is probed, and how much of it each probe stands for.
constexpr float kBelow[] = {0.7f, 2.1f, 4.2f, 8.4f, 16.8f, 33.6f};
constexpr float kStands[] = {1.4f, 1.4f, 2.8f, 5.6f, 11.2f, 22.4f};
constexpr int kHalvings = 2;
constexpr float kEnds = 0.2f;  // of the density as placed: there is no snow any more
constexpr float kDeep = 300;   // transport depths: below them nothing changes (T < 0.5 %)
// Cells before a point, and how much of the sky snow there would hide.
constexpr float kBefore[] = {2, 4, 8};
constexpr float kHides[] = {0.3f, 0.25f, 0.2f};

}  // namespace

void PreviewTile::probe() {
  group_points();
  const std::size_t count = groups_.size();
  density_.resize(count);
  for (int a = 0; a < 3; ++a) {
    for (auto* column : {&probe_from_[a], &probe_down_[a], &probe_up_[a]}) column->resize(count);
    for (std::size_t g = 0; g < count; ++g) {
      probe_from_[a][g] = groups_[g].p[a];
      probe_up_[a][g] = groups_[g].normal[a];
      probe_down_[a][g] = -groups_[g].normal[a];
    }
  }
  measure_openings();
  measure_columns();
}

void PreviewTile::group_points() {
  groups_.clear();
  const auto count = static_cast<std::uint32_t>(points_.size());
  for (std::uint32_t first = 0, end; first < count; first = end) {
    const Point& point = points_[first];
    Vec3f p = point.p, normal = point.smooth;
    for (end = first + 1; end < count && alike(point, points_[end]); ++end)
      p += points_[end].p, normal += points_[end].smooth;
    const std::uint32_t size = end - first;
    if (size > 1) p /= static_cast<float>(size), normal.normalize();
    const float placed = density_placed_[std::min<std::size_t>(point.object, density_placed_.size() - 1)];
    for (std::uint32_t k = first; k < end; ++k) points_[k].group = static_cast<std::uint32_t>(groups_.size());
    groups_.push_back({first, size, p, normal, placed, 0, 1, 0, 0, {}});
  }
}

bool PreviewTile::alike(const Point& point, const Point& other) const {
  const float near = kNear * view_.grid.view().cell;
  return point.pixel / kNeighbours == other.pixel / kNeighbours && point.snow() == other.snow() &&
         point.object == other.object && (point.p - other.p).squaredNorm() < near * near &&
         point.smooth.dot(other.smooth) > kLikeNormals;
}

// From probe to probe deeper, until all columns have ended or are deep; those that go on move up.
void PreviewTile::measure_columns() {
  const float cell = view_.grid.view().cell;
  const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                  {probe_down_[0].data(), probe_down_[1].data(), probe_down_[2].data()}};
  std::size_t left = 0;
  const auto keep = [&](std::size_t from, std::uint32_t group) {
    for (int a = 0; a < 3 && left < from; ++a) {
      probe_from_[a][left] = probe_from_[a][from];
      probe_down_[a][left] = probe_down_[a][from];
    }
    open_[left++] = group;
  };
  open_.resize(groups_.size()), ends_.clear();
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (points_[groups_[g].first].snow()) keep(g, static_cast<std::uint32_t>(g));
  }
  float done = 0;  // cells that the probes before stand for
  for (std::size_t step = 0; step < std::size(kBelow) && left > 0; ++step) {
    const std::size_t count = std::exchange(left, 0);
    view_.field.probe_density(probes, kBelow[step] * cell, count, density_.data());
    for (std::size_t k = 0; k < count; ++k) {
      Group& group = groups_[open_[k]];
      if (!(density_[k] > kEnds * group.placed)) {
        ends_.push_back({open_[k], step > 0 ? kBelow[step - 1] : 0, kBelow[step], done});
        continue;
      }
      group.column += density_[k] * kStands[step] * cell;
      if (layers_.transport_depth(points_[group.first].object, group.column) < kDeep) keep(k, open_[k]);
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
      const Group& group = groups_[ends_[e].group];
      const float middle = 0.5f * (ends_[e].within + ends_[e].beyond) * cell;
      for (int a = 0; a < 3; ++a)
        probe_from_[a][e] = group.p[a], probe_down_[a][e] = -middle * group.normal[a];
    }
    const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                    {probe_down_[0].data(), probe_down_[1].data(), probe_down_[2].data()}};
    view_.field.probe_density(probes, 1, count, density_.data());
    for (std::size_t e = 0; e < count; ++e) {
      End& end = ends_[e];
      const float middle = 0.5f * (end.within + end.beyond);
      (density_[e] > kEnds * groups_[end.group].placed ? end.within : end.beyond) = middle;
    }
  }
  for (const End& end : ends_) {
    if (!(end.counted > 0)) continue;  // thinner than the first probe is deep
    groups_[end.group].column *= 0.5f * (end.within + end.beyond) / end.counted;
  }
}

void PreviewTile::measure_openings() {
  if (view_.grid.size() == 0) return;
  const float cell = view_.grid.view().cell;
  const kernels::ProbeView probes{{probe_from_[0].data(), probe_from_[1].data(), probe_from_[2].data()},
                                  {probe_up_[0].data(), probe_up_[1].data(), probe_up_[2].data()}};
  const float full = 1 / static_cast<float>(view_.setup.snow.front().density);
  for (std::size_t step = 0; step < std::size(kBefore); ++step) {
    view_.field.probe_density(probes, kBefore[step] * cell, groups_.size(), density_.data());
    for (std::size_t g = 0; g < groups_.size(); ++g)
      groups_[g].opening -= kHides[step] * std::min(density_[g] * full, 1.f);
  }
}

}  // namespace firn
