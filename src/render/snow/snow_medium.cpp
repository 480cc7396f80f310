// SPDX-License-Identifier: MIT
// The snow as a medium: SnowField's density -> what flights must know of the cells, as
// kernels/trace/medium.cpp reads them.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "src/core/parallel.h"
#include "src/render/snow/snow_field.h"

namespace firn {
namespace {

using kernels::kBrickCorners;
using kernels::kCellsPerBrick;

constexpr float kSimilar = 5;                          // mean free paths
constexpr float kDepths[] = {0.4f, 0.8f, 1.6f, 3, 5};  // reduced mean free paths, where classes begin
constexpr std::size_t kMostLayers = 8;                 // cells; where more would be needed, none is deep
constexpr int kThick = 4;                              // the class of which there is some in thick snow
// Cells. Farther than the layers that make a cell of that class, for they are cubes: on a round body the snow
// before the middle of a cube's side reaches beyond it.
constexpr std::size_t kThickReach = 12;

// by_collisions: the chance that a collision is connected to lights, by the class of its cell's depth. What
// arrives there directly fades as exp(-depth), and the best chance by its root.
constexpr float kLit[kernels::kClass + 1] = {1, 0.7f, 0.5f, 0.25f, 0.1f, 0.05f, 0.05f, 0.05f};

std::uint32_t kind_of(const std::vector<std::uint32_t>& kinds, std::size_t cell) {
  return kinds[cell >> 3] >> (4 * (cell & 7)) & 15;
}

// The cells of a brick that are in `cells` as their neighbours along an axis are (erode), or that are or have
// one that is (dilate); below, above: those of the bricks beside it.
enum class Change { erode, dilate };
std::uint64_t changed(Change change, std::uint64_t cells, std::uint64_t below, std::uint64_t above,
                      int axis) {
  constexpr std::uint64_t kFirst[3] = {0x000000000000ffffull, 0x000f000f000f000full, 0x1111111111111111ull};
  const int step = 16 >> (2 * axis);
  const std::uint64_t first = kFirst[axis], last = first << (3 * step);
  const std::uint64_t before = (cells << step & ~first) | (below >> (3 * step) & first);
  const std::uint64_t after = (cells >> step & ~last) | (above << (3 * step) & last);
  return change == Change::erode ? cells & before & after : cells | before | after;
}

// Bricks by slot, with those beside them: SIZE_MAX where there is none.
using Beside = std::vector<std::array<std::size_t, 6>>;  // below and above along each axis

// Changes all cells along one axis after the other, `layers` times.
void change_cells(Change change, std::size_t layers, const Beside& beside,
                  std::vector<std::uint64_t>& cells) {
  std::vector<std::uint64_t> next(cells.size());
  for (std::size_t round = 0; round < 3 * layers; ++round) {
    const std::size_t axis = round % 3;
    parallel_for(cells.size(), 1024, [&](std::size_t slot) {
      const auto of = [&](std::size_t other) { return other == SIZE_MAX ? std::uint64_t{0} : cells[other]; };
      next[slot] = changed(change, cells[slot], of(beside[slot][2 * axis]), of(beside[slot][2 * axis + 1]),
                           static_cast<int>(axis));
    });
    cells.swap(next);
  }
}

// A word of MediumField::cell, of the densest and the thinnest that is there (kg/m^3) and its extinction
// (m^2/kg).
std::uint32_t medium_cell(float extinction, float densest, float thinnest) {
  const float most = densest * extinction;
  if (!(most > 0)) return 0;
  const std::uint32_t cut = ~kernels::kMostExtinction & 0x7fffffffu;
  const std::uint32_t rounded = (std::bit_cast<std::uint32_t>(most) + cut) & kernels::kMostExtinction;
  constexpr float kWhole = 1 << kernels::kLeastBits;
  const float share = kWhole * (thinnest * extinction) / std::bit_cast<float>(rounded);
  return rounded | static_cast<std::uint32_t>(std::min(share, kWhole - 1)) << kernels::kLeastAt;
}

// The corners of a cell, first to last: run(value).
template <class Run>
void for_each_corner(const std::vector<float>& field, std::size_t cell, Run&& run) {
  const int c = static_cast<int>(cell % kCellsPerBrick);
  const float* corner =
      &field[cell / kCellsPerBrick * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
  for (int k = 0; k < 8; ++k) run(corner[corner_index(k >> 2, k >> 1 & 1, k & 1)]);
}
float most(const std::vector<float>& field, std::size_t cell) {
  float value = -std::numeric_limits<float>::infinity();
  for_each_corner(field, cell, [&](float corner) { value = std::max(value, corner); });
  return value;
}
float least(const std::vector<float>& field, std::size_t cell) {
  float value = std::numeric_limits<float>::infinity();
  for_each_corner(field, cell, [&](float corner) { value = std::min(value, corner); });
  return value;
}

// The cells of each brick that lie deep. Of n layers, each of a depth of at least 1 / n, in steps of one
// layer: what is left of their cells when the outermost n are taken off is deep. A cell's depth is what it
// has of `thinnest` times `scale`.
std::vector<std::uint64_t> find_deep(const Beside& beside, const std::vector<float>& thinnest, float scale) {
  const std::size_t slots = beside.size();
  std::vector<std::array<std::uint64_t, kMostLayers>> thick(slots);
  parallel_for(slots, 32, [&](std::size_t slot) {
    for (std::size_t c = 0; c < kCellsPerBrick; ++c) {
      const float depth = scale * thinnest[slot * kCellsPerBrick + c];
      for (std::size_t n = 0; n < kMostLayers; ++n)
        thick[slot][n] |= std::uint64_t{depth * static_cast<float>(n + 1) >= 1} << c;
    }
  });
  std::vector<std::uint64_t> deep(slots), left(slots);
  for (std::size_t n = 0; n < kMostLayers; ++n) {
    for (std::size_t slot = 0; slot < slots; ++slot) left[slot] = thick[slot][n];
    change_cells(Change::erode, n + 1, beside, left);
    for (std::size_t slot = 0; slot < slots; ++slot) deep[slot] |= left[slot];
  }
  return deep;
}

}  // namespace

float SnowField::majorant(std::size_t cell) const { return most(density_, cell); }

// What a stray is made of fills its ball evenly.
void SnowField::measure_strays(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const kernels::TraceGrid& grid = grid_->view();
  stray_extinction_.assign(grid.stray_bundles * kernels::kRayLanes, 0.f);
  for (std::size_t k = 0; k < stray_extinction_.size(); ++k) {
    const std::uint32_t s = grid.strays[k / kernels::kRayLanes].particle[k % kernels::kRayLanes];
    if (s == kernels::kNoHit) continue;
    const std::uint32_t i = grid_->snapshot_index(s);
    const std::size_t object = snapshot.object[i];
    const SnowLook look = looks.empty() ? SnowLook{} : looks[std::min(object, looks.size() - 1)];
    const double room = 4 * std::numbers::pi / 3 * std::pow(static_cast<double>(grid_->radius(s)), 3);
    stray_extinction_[k] = static_cast<float>(snapshot.volume0[i] * look.density * look.extinction / room);
  }
}

// Adds `its` to the words of the cells.
void SnowField::mark_depth(const std::vector<std::uint64_t>& cells, std::uint32_t its) {
  parallel_for(depth_.size(), 1024, [&](std::size_t word) {
    const std::uint64_t here = cells[word / 8] >> (8 * (word % 8)) & 0xff;
    for (int c = 0; c < 8; ++c) depth_[word] += (here >> c & 1 ? its : 0) << (4 * c);
  });
}

// The classes of the cells, and which are in thick snow.
void SnowField::find_depths(const std::vector<float>& density, const SnowOptics& optics) {
  const std::size_t slots = grid_->brick_of_slot().size();
  depth_.assign(slots * kCellsPerBrick / 8, 0);
  if (optics.similarity == Similarity::never) return;
  constexpr int kNext[3] = {9, 3, 1};  // as around() numbers the bricks; 13 is the slot's own
  Beside beside(slots);
  parallel_for(slots, 32, [&](std::size_t slot) {
    for (std::size_t k = 0; k < 6; ++k)
      beside[slot][k] = around(slot, k % 2 == 0 ? 13 - kNext[k / 2] : 13 + kNext[k / 2]);
  });
  std::vector<float> thinnest(slots * kCellsPerBrick);  // the least density of a cell that is all snow, or 0
  parallel_for(thinnest.size(), 4096, [&](std::size_t cell) {
    if ((kind_of(kind_, cell) & 3) == kernels::kInside) thinnest[cell] = least(density, cell);
  });
  const bool by_depth = optics.similarity == Similarity::by_depth;
  const float in_cell = grid_->view().cell * extinction_;
  for (int its = 1; its <= (by_depth ? 1 : static_cast<int>(std::size(kDepths))); ++its) {
    const float path = by_depth ? kSimilar : kDepths[its - 1] / (1 - optics.g);
    std::vector<std::uint64_t> deep = find_deep(beside, thinnest, in_cell / path);
    if (std::all_of(deep.begin(), deep.end(), [](std::uint64_t cells) { return cells == 0; })) return;
    mark_depth(deep, 1);
    if (its != kThick) continue;
    change_cells(Change::dilate, kThickReach, beside, deep);
    mark_depth(deep, kernels::kThickSnow);
  }
}

void SnowField::mark_shared(const SnowOptics& optics) {
  const kernels::TraceGrid& view = grid_->view();
  const float side = kernels::kBrickCells * view.cell;
  parallel_for(grid_->brick_of_slot().size(), 64, [&](std::size_t slot) {
    const std::uint32_t brick = grid_->brick_of_slot()[slot];
    const auto across = static_cast<std::uint32_t>(view.bricks[2]),
               down = static_cast<std::uint32_t>(view.bricks[1]);
    const Vec3f low =
        side * Vec3f(static_cast<float>(brick / across / down), static_cast<float>(brick / across % down),
                     static_cast<float>(brick % across));
    if (optics.shared && !optics.shared(low, low + Vec3f::Constant(side))) return;
    for (std::size_t c = 0; c < kCellsPerBrick; ++c) cells_[slot * kCellsPerBrick + c] |= kernels::kShared;
  });
}

void SnowField::find_cells(const kernels::MediumField& field) {
  const std::vector<float>& density = sigma_.empty() ? density_ : sigma_;
  cells_.resize(grid_->brick_of_slot().size() * kCellsPerBrick);
  parallel_for(cells_.size(), 4096, [&](std::size_t cell) {
    const std::uint32_t kind = kind_of(kind_, cell), deep = kind_of(depth_, cell);
    const bool has_balls = (kind & kernels::kHasLoose) != 0, of_balls = field.ball_density < 0;
    float densest = of_balls || !has_balls ? 0.f : field.ball_density, thinnest = 0;
    if ((kind & 3) != kernels::kOutside || (of_balls && has_balls))
      densest = std::max(densest, most(density, cell));
    if ((kind & 3) == kernels::kInside && !of_balls) thinnest = least(density, cell);
    cells_[cell] =
        medium_cell((deep & kernels::kClass) != 0 ? field.reduced : field.extinction, densest, thinnest) |
        deep;
  });
}

kernels::MediumField SnowField::medium(const SnowOptics& optics) {
  const std::vector<float>& density = sigma_.empty() ? density_ : sigma_;
  kernels::MediumField field;
  field.density = density.data();
  field.fill = fill_.data();
  field.cell_kind = kind_.data();
  field.level = surface_.level;
  field.extinction = extinction_;
  const bool by_depth = optics.similarity == Similarity::by_depth;
  field.reduced = by_depth ? extinction_ * (1 - optics.g) : extinction_;
  field.ball_density = ball_density_;
  field.stray_extinction = stray_extinction_.data();
  field.lit = kLit;
  field.most_scattered = optics.most_scattered;
  find_depths(density, optics);
  find_cells(field);
  if (optics.similarity == Similarity::by_collisions) mark_shared(optics);
  field.cell = cells_.data();
  return field;
}

}  // namespace firn
