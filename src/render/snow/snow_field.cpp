// SPDX-License-Identifier: MIT
#include "src/render/snow/snow_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kBrickCorners;
using kernels::kCellsPerBrick;
using kernels::kFieldTile;

constexpr float kLevel = 0.5f;
}  // namespace

// Of each occupied brick the slots of the 27 bricks around it, -1 where none is occupied.
void SnowField::find_neighbours() {
  const kernels::TraceGrid& grid = grid_->view();
  neighbours_.resize(grid_->brick_of_slot().size());
  parallel_for(neighbours_.size(), 64, [&](std::size_t slot) {
    int p[3];
    brick_place(grid, grid_->brick_of_slot()[slot], p);
    for (int k = 0; k < 27; ++k) {
      const int q[3] = {p[0] + k / 9 - 1, p[1] + k / 3 % 3 - 1, p[2] + k % 3 - 1};
      bool there = true;
      for (int a = 0; a < 3; ++a) there = there && q[a] >= 0 && q[a] < grid.bricks[a];
      neighbours_[slot][k] = there ? std::max(grid.slot[brick_index(grid, q[0], q[1], q[2])], -1) : -1;
    }
  });
}

// Each brick whose particles add something gets a tile. False: none does.
bool SnowField::splat_bricks(const std::vector<float>& amount) {
  const kernels::TraceGrid& grid = grid_->view();
  const std::size_t slots = grid_->brick_of_slot().size();
  tile_at_.resize(slots);
  std::uint32_t tiles = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) tile_at_[slot] = splats_[slot] ? tiles++ : kNone;
  tile_.reserve_discarding(static_cast<std::size_t>(tiles) * kFieldTile);
  parallel_for(slots, 8, [&](std::size_t slot) {
    if (tile_at_[slot] == kNone) return;
    float* tile = tile_.data() + static_cast<std::size_t>(tile_at_[slot]) * kFieldTile;
    std::fill(tile, tile + kFieldTile, 0.f);
    int first[3];
    brick_place(grid, grid_->brick_of_slot()[slot], first);
    for (int& cell : first) cell *= kBrickCells;
    kernels_.splat(grid, first, grid.cell_start[slot * kCellsPerBrick],
                   grid.cell_start[(slot + 1) * kCellsPerBrick], amount.data(), tile);
  });
  return tiles > 0;
}

// Adds the tiles that reach each brick's corners to them, always in the same order; then calls done(slot).
template <class Done>
void SnowField::gather_corners(std::vector<float>& corners, bool from_zero, Done&& done) {
  parallel_for(grid_->brick_of_slot().size(), 16, [&](std::size_t slot) {
    const float* tiles[27];
    bool any = false;
    for (int k = 0; k < 27; ++k) {
      const std::int32_t other = neighbours_[slot][k];
      const bool there = other >= 0 && tile_at_[other] != kNone;
      tiles[k] = there ? tile_.data() + static_cast<std::size_t>(tile_at_[other]) * kFieldTile : nullptr;
      any = any || there;
    }
    float* its = &corners[slot * kBrickCorners];
    if (from_zero) std::fill(its, its + kBrickCorners, 0.f);
    if (any) kernels_.sum_tiles(tiles, its);
    if (any || from_zero) done(slot);
  });
}

template <class Done>
void SnowField::splat(const std::vector<float>& amount, std::vector<float>& corners, Done&& done) {
  const std::size_t slots = grid_->brick_of_slot().size();
  const std::uint32_t* start = grid_->view().cell_start;
  corners.resize(slots * kBrickCorners);
  splats_.resize(slots);
  for (std::size_t slot = 0; slot < slots; ++slot)
    splats_[slot] = start[slot * kCellsPerBrick] < start[(slot + 1) * kCellsPerBrick];
  splat_bricks(amount);
  gather_corners(corners, true, done);
}

// Adds to the fill what the bricks that splat say. False: nothing.
bool SnowField::add_to_fill(const std::vector<float>& amount) {
  if (!splat_bricks(amount)) return false;
  gather_corners(fill_, false, [this](std::size_t slot) { note_span(slot); });
  return true;
}

// Of all corners of a brick.
void SnowField::note_span(std::size_t slot) {
  constexpr int kSide = 8;  // minima side by side become registers
  const float* corner = &fill_[slot * kBrickCorners];
  float least[kSide], most[kSide];
  std::copy(corner, corner + kSide, least);
  std::copy(corner, corner + kSide, most);
  const auto see = [&](const float* row) {
    for (int i = 0; i < kSide; ++i) {
      least[i] = row[i] < least[i] ? row[i] : least[i];
      most[i] = row[i] > most[i] ? row[i] : most[i];
    }
  };
  for (int c = kSide; c + kSide <= kBrickCorners; c += kSide) see(corner + c);
  see(corner + kBrickCorners - kSide);
  spans_[slot] = {*std::min_element(least, least + kSide), *std::max_element(most, most + kSide)};
}

void SnowField::find_kinds() {
  const std::size_t slots = grid_->brick_of_slot().size();
  kind_.resize(slots * 8);
  parallel_for(slots, 32, [&](std::size_t slot) {
    std::uint32_t* words = &kind_[slot * 8];
    const Span span = fill_.empty() ? Span{} : spans_[slot];
    const bool crossed = span.least < kLevel && span.most >= kLevel;
    std::fill(words, words + 8, span.least >= kLevel ? kernels::kInside * 0x11111111u : 0);
    const CellSpans cells = crossed ? cell_spans(slot) : CellSpans{};
    const std::uint32_t* list = &grid_->view().list[slot * kCellsPerBrick];
    for (int c = 0; c < kCellsPerBrick; ++c) {
      std::uint32_t kind = list[c] != 0 ? std::uint32_t{kernels::kHasLoose} : 0u;
      if (crossed && cells.most[c] >= kLevel)
        kind |= cells.least[c] >= kLevel ? kernels::kInside : kernels::kCrossed;
      words[c >> 3] |= kind << (4 * (c & 7));
    }
  });
}

// Rays leap over bricks that hold neither surface nor loose balls nor snow.
void SnowField::close_bricks() {
  view_ = grid_->view();
  slot_.assign(view_.slot,
               view_.slot + static_cast<std::size_t>(view_.bricks[0]) * view_.bricks[1] * view_.bricks[2]);
  for (std::size_t slot = 0; slot < grid_->brick_of_slot().size(); ++slot) {
    std::uint32_t any = 0;
    for (std::size_t w = 0; w < 8; ++w) any |= kind_[slot * 8 + w];
    if (any == 0) slot_[grid_->brick_of_slot()[slot]] = -1;
  }
  measure_clearance(view_.bricks, slot_);
  view_.slot = slot_.data();
}

// Of each particle volume and mass, over the room of a cell.
void SnowField::weigh(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const double per_cell = std::pow(static_cast<double>(grid_->view().inv_cell), 3);
  const auto look_of = [&](std::uint32_t i) {
    return looks.empty() ? SnowLook{} : looks[std::min<std::size_t>(snapshot.object[i], looks.size() - 1)];
  };
  const auto volume_of = [&](std::uint32_t i) { return static_cast<float>(snapshot.volume0[i] * per_cell); };
  volume_.resize(grid_->size()), mass_.resize(grid_->size());
  parallel_chunks(grid_->size(), kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    if (grid_->alike()) {
      std::fill(volume_.data() + begin, volume_.data() + end, volume_of(0));
      std::fill(mass_.data() + begin, mass_.data() + end,
                static_cast<float>(volume_of(0) * look_of(0).density));
      return;
    }
    for (std::size_t s = begin; s < end; ++s) {
      const std::uint32_t i = grid_->snapshot_index(static_cast<std::uint32_t>(s));
      volume_[s] = volume_of(i);
      mass_[s] = static_cast<float>(volume_[s] * look_of(i).density);
    }
  });
}

// Density and fill. Of snow that is all of one density as placed the fill is the density, but for a factor.
void SnowField::splat_snow(const std::vector<SnowLook>& looks, bool smooth) {
  const double density = looks.empty() ? SnowLook{}.density : looks.front().density;
  const bool even =
      std::all_of(looks.begin(), looks.end(), [&](const SnowLook& look) { return look.density == density; });
  const std::size_t slots = grid_->brick_of_slot().size();
  fill_.resize(smooth ? slots * kBrickCorners : 0);
  spans_.resize(slots);
  const float by_mass = static_cast<float>(1 / density);
  splat(mass_, density_, [&](std::size_t slot) {
    if (!smooth || !even) return;
    for (std::size_t c = slot * kBrickCorners; c < (slot + 1) * kBrickCorners; ++c)
      fill_[c] = density_[c] * by_mass;
    note_span(slot);
  });
  if (smooth && !even) splat(volume_, fill_, [&](std::size_t slot) { note_span(slot); });
}

// Extinction, where objects differ in it.
void SnowField::splat_optics(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const SnowLook first = looks.empty() ? SnowLook{} : looks.front();
  const bool alike = std::all_of(looks.begin(), looks.end(),
                                 [&](const SnowLook& look) { return look.extinction == first.extinction; });
  sigma_.clear();
  extinction_ = alike ? static_cast<float>(first.extinction) : 1.f;
  if (alike) return;
  optical_.resize(grid_->size());
  parallel_chunks(grid_->size(), kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const std::size_t object = snapshot.object[grid_->snapshot_index(static_cast<std::uint32_t>(s))];
      optical_[s] = mass_[s] * static_cast<float>(looks[std::min(object, looks.size() - 1)].extinction);
    }
  });
  splat(optical_, sigma_, [](std::size_t) {});
}

// The balls of loose particles, and company for the others.
void SnowField::close_surface(RenderGrid& grid, const Snapshot& snapshot) {
  find_loose(snapshot);
  grid.set_radii(radii_);
  add_company();
  struct Sum {
    double mass = 0, optical = 0, room = 0;
  };
  const std::vector<float>& optical = sigma_.empty() ? mass_ : optical_;
  std::vector<Sum> sums((radii_.size() + kParticleChunk - 1) / kParticleChunk);
  parallel_chunks(radii_.size(), kParticleChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      if (!(radii_[s] > 0)) continue;
      sums[chunk].mass += mass_[s];
      sums[chunk].optical += optical[s];
      sums[chunk].room += volume_[s];
    }
  });
  Sum all;
  for (const Sum& sum : sums) all.mass += sum.mass, all.optical += sum.optical, all.room += sum.room;
  ball_density_ = all.room > 0 ? static_cast<float>(all.optical / all.room) : 0.f;
  loose_density_ = all.room > 0 ? static_cast<float>(all.mass / all.room) : 0.f;
}

void SnowField::build(RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks,
                      SnowShape shape) {
  grid_ = &grid;
  find_neighbours();
  weigh(snapshot, looks);
  splat_snow(looks, shape == SnowShape::smooth);
  splat_optics(snapshot, looks);
  ball_density_ = -1;
  if (shape == SnowShape::smooth) {
    close_surface(grid, snapshot);
  } else {
    grid.empty_unreached_lists();
  }
  find_kinds();
  close_bricks();
  measure_gradients();
  measure_strays(snapshot, looks);
  surface_.fill = fill_.data();
  surface_.cell_kind = kind_.data();
  surface_.level = kLevel;
}

bool SnowField::find(const Vec3f& p, Place& place) const {
  const kernels::TraceGrid& grid = grid_->view();
  int cell[3];
  for (int a = 0; a < 3; ++a) {
    const float at = p[a] * grid.inv_cell;
    if (!(at >= 0 && at < static_cast<float>(grid.cells[a]))) return false;
    cell[a] = static_cast<int>(at);
    place.cell[a] = cell[a] & 3;
    place.part[a] = at - static_cast<float>(cell[a]);
  }
  const std::size_t index = cell_index(grid, cell[0], cell[1], cell[2]);
  if (index == kNoCell) return false;
  place.slot = index / kCellsPerBrick;
  return true;
}

float SnowField::interpolate(const std::vector<float>& field, const Place& place) const {
  const float* corner =
      &field[place.slot * kBrickCorners + corner_index(place.cell[0], place.cell[1], place.cell[2])];
  float sum = 0;
  for (int k = 0; k < 8; ++k) {
    const int x = k >> 2, y = k >> 1 & 1, z = k & 1;
    sum += (x ? place.part[0] : 1 - place.part[0]) * (y ? place.part[1] : 1 - place.part[1]) *
           (z ? place.part[2] : 1 - place.part[2]) * corner[corner_index(x, y, z)];
  }
  return sum;
}

float SnowField::density(const Vec3f& p) const {
  Place place;
  return find(p, place) ? interpolate(density_, place) : 0.f;
}
float SnowField::fill(const Vec3f& p) const {
  Place place;
  return find(p, place) ? interpolate(fill_, place) : 0.f;
}

// The own cell first, then along each axis the nearer side, and only what is near enough.
std::uint32_t SnowField::particle_near(const Vec3f& p) const {
  const kernels::TraceGrid& grid = grid_->view();
  int beside[3][3];    // cells along each axis, in that order
  float apart2[3][3];  // m^2, to them
  for (int a = 0; a < 3; ++a) {
    const int own =
        static_cast<int>(std::clamp(p[a] * grid.inv_cell, 0.f, static_cast<float>(grid.cells[a] - 1)));
    const float below = std::max(p[a] - static_cast<float>(own) * grid.cell, 0.f);
    const float above = std::max(grid.cell - below, 0.f);
    const int nearer = below < above ? -1 : 1;
    beside[a][0] = own, beside[a][1] = own + nearer, beside[a][2] = own - nearer;
    apart2[a][0] = 0;
    apart2[a][1] = std::min(below, above) * std::min(below, above);
    apart2[a][2] = std::max(below, above) * std::max(below, above);
  }
  std::uint32_t best = kernels::kNoHit;
  float least = std::numeric_limits<float>::infinity();
  constexpr float kRounding = 1 - 1e-5f;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const float across = apart2[0][i] + apart2[1][j];
      for (int k = 0; k < 3 && (across + apart2[2][k]) * kRounding <= least; ++k) {
        const std::size_t near = cell_index(grid, beside[0][i], beside[1][j], beside[2][k]);
        if (near == kNoCell) continue;
        for (std::uint32_t s = grid.cell_start[near]; s < grid.cell_start[near + 1]; ++s) {
          const float x = grid.x[s] - p.x(), y = grid.y[s] - p.y(), z = grid.z[s] - p.z();
          const float distance = x * x + y * y + z * z;
          if (distance < least || (distance == least && s < best)) least = distance, best = s;
        }
      }
    }
  }
  return best;
}

std::uint32_t SnowField::particle_at_surface(const Vec3f& p) const {
  const std::uint32_t near = particle_near(p);
  return near == kernels::kNoHit ? 0 : near;
}

std::size_t SnowField::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(fill_) + of(density_) + of(kind_) + of(gradient_at_) + of(gradient_) + tile_.resident_bytes() +
         of(tile_at_) + of(slot_) + of(sigma_) + of(stray_extinction_) + of(cells_) + of(depth_);
}

}  // namespace firn
