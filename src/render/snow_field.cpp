// SPDX-License-Identifier: MIT
#include "src/render/snow_field.h"

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
// A particle whose place is filled less than this counts as much more as it lacks, up to a limit: snow that
// is stretched to kCompany / kMostCompany of its density stays closed.
constexpr float kCompany = 0.55f, kMostCompany = 6.0f;
constexpr int kCompanyRounds = 3;
// Spacings: the ball of a particle's own volume. A particle that is alone fills its place by kLone at most;
// the ball shrinks as the others fill more of it, up to kCovered, where the surface takes over.
constexpr float kLooseRadius = 0.62f, kLone = 0.11f, kCovered = 0.2f, kCoveredRadius = 0.1f;

}  // namespace

// The slots of the 27 bricks around, SIZE_MAX where none is occupied.
void SnowField::all_around(std::size_t slot, std::size_t slots[27]) const {
  const kernels::TraceGrid& grid = grid_->view();
  int p[3];
  brick_place(grid, grid_->brick_of_slot()[slot], p);
  for (int k = 0; k < 27; ++k) {
    const int q[3] = {p[0] + k / 9 - 1, p[1] + k / 3 % 3 - 1, p[2] + k % 3 - 1};
    bool there = true;
    for (int a = 0; a < 3; ++a) there = there && q[a] >= 0 && q[a] < grid.bricks[a];
    const std::int32_t its = there ? grid.slot[brick_index(grid, q[0], q[1], q[2])] : -1;
    slots[k] = its < 0 ? SIZE_MAX : static_cast<std::size_t>(its);
  }
}

std::size_t SnowField::around(std::size_t slot, int k) const {
  std::size_t slots[27];
  all_around(slot, slots);
  return slots[k];
}

// Each brick whose particles add something gets a tile.
void SnowField::splat_bricks(const std::vector<float>& amount) {
  const kernels::TraceGrid& grid = grid_->view();
  const std::size_t slots = grid_->brick_of_slot().size();
  tile_at_.resize(slots);
  std::uint32_t tiles = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) tile_at_[slot] = splats_[slot] ? tiles++ : kNone;
  tile_.resize(static_cast<std::size_t>(tiles) * kFieldTile);
  parallel_for(slots, 8, [&](std::size_t slot) {
    if (tile_at_[slot] == kNone) return;
    float* tile = &tile_[static_cast<std::size_t>(tile_at_[slot]) * kFieldTile];
    std::fill(tile, tile + kFieldTile, 0.f);
    int first[3];
    brick_place(grid, grid_->brick_of_slot()[slot], first);
    for (int& cell : first) cell *= kBrickCells;
    kernels_.splat(grid, first, grid.cell_start[slot * kCellsPerBrick],
                   grid.cell_start[(slot + 1) * kCellsPerBrick], amount.data(), tile);
  });
}

// Sums the tiles that reach each brick's corners, always in the same order.
void SnowField::gather_corners(std::vector<float>& corners, bool add) const {
  const std::size_t slots = grid_->brick_of_slot().size();
  parallel_for(slots, 16, [&](std::size_t slot) {
    float* out = &corners[slot * kBrickCorners];
    if (!add) std::fill(out, out + kBrickCorners, 0.f);
    std::size_t others[27];
    all_around(slot, others);
    for (int k = 0; k < 27; ++k) {
      const std::size_t other = others[k];
      if (other == SIZE_MAX || tile_at_[other] == kNone) continue;
      const float* tile = &tile_[static_cast<std::size_t>(tile_at_[other]) * kFieldTile];
      const int step[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
      int low[3], high[3];
      for (int a = 0; a < 3; ++a) {
        low[a] = step[a] > 0 ? kBrickCells - 1 : 0;
        high[a] = step[a] < 0 ? 1 : kBrickCells;
      }
      for (int x = low[0]; x <= high[0]; ++x) {
        for (int y = low[1]; y <= high[1]; ++y) {
          const float* row = tile + field_tile_index(x - kBrickCells * step[0], y - kBrickCells * step[1],
                                                     -kBrickCells * step[2]);
          float* to = out + corner_index(x, y, 0);
          for (int z = low[2]; z <= high[2]; ++z) to[z] += row[z];
        }
      }
    }
  });
}

void SnowField::splat(const std::vector<float>& amount, std::vector<float>& corners) {
  const std::size_t slots = grid_->brick_of_slot().size();
  const std::uint32_t* start = grid_->view().cell_start;
  corners.resize(slots * kBrickCorners);
  splats_.resize(slots);
  for (std::size_t slot = 0; slot < slots; ++slot)
    splats_[slot] = start[slot * kCellsPerBrick] < start[(slot + 1) * kCellsPerBrick];
  splat_bricks(amount);
  gather_corners(corners, false);
}

// Of the corners of those cells that hold particles.
float SnowField::least_fill(std::size_t slot) const {
  const std::uint32_t* start = &grid_->view().cell_start[slot * kCellsPerBrick];
  float least = std::numeric_limits<float>::infinity();
  for (int c = 0; c < kCellsPerBrick; ++c) {
    if (start[c] == start[c + 1]) continue;
    const float* corner = &fill_[slot * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
    for (int k = 0; k < 8; ++k) least = std::min(least, corner[corner_index(k >> 2, k >> 1 & 1, k & 1)]);
  }
  return least;
}

void SnowField::fill_at_particles(std::size_t slot) {
  const kernels::TraceGrid& grid = grid_->view();
  const kernels::ProbeView at{{grid.x, grid.y, grid.z}, {grid.x, grid.y, grid.z}};
  kernels_.probe(grid, fill_.data(), at, 0, grid.cell_start[slot * kCellsPerBrick],
                 grid.cell_start[(slot + 1) * kCellsPerBrick], here_.data());
}

// Adds to the fill what particles with little company count for more. What one adds, its neighbours feel: a
// few rounds bring most places to kCompany.
void SnowField::add_company() {
  const kernels::TraceGrid& grid = grid_->view();
  const std::size_t slots = grid_->brick_of_slot().size();
  counts_.assign(volume_.size(), 1.f);
  more_.resize(volume_.size());
  for (int round = 0; round < kCompanyRounds; ++round) {
    parallel_for(slots, 16, [&](std::size_t slot) {
      splats_[slot] = 0;
      if (least_fill(slot) >= kCompany) return;
      fill_at_particles(slot);
      for (std::uint32_t s = grid.cell_start[slot * kCellsPerBrick];
           s < grid.cell_start[(slot + 1) * kCellsPerBrick]; ++s) {
        more_[s] = 0;
        if (!(here_[s] < kCompany) || counts_[s] >= kMostCompany) continue;
        const float wanted = std::min(counts_[s] * kCompany / std::max(here_[s], 1e-3f), kMostCompany);
        more_[s] = volume_[s] * (wanted - counts_[s]);
        counts_[s] = wanted;
        splats_[slot] = 1;
      }
    });
    splat_bricks(more_);
    if (tile_.empty()) return;
    gather_corners(fill_, true);
  }
}

// The ball that each particle is beside the surface.
void SnowField::find_loose(const Snapshot& snapshot) {
  const std::uint32_t* start = grid_->view().cell_start;
  radii_.assign(grid_->size(), -1.f);
  const std::size_t slots = grid_->brick_of_slot().size();
  const auto radius = [&](std::uint32_t s, float here) {
    if (here >= kCovered) return;
    const float part = std::max(here - kLone, 0.f) / (kCovered - kLone);
    const float share = kLooseRadius + (kCoveredRadius - kLooseRadius) * part;
    radii_[s] = share * static_cast<float>(portable_cbrt(snapshot.volume0[grid_->snapshot_index(s)]));
  };
  parallel_for(slots, 16, [&](std::size_t slot) {
    if (least_fill(slot) >= kCovered) return;
    fill_at_particles(slot);
    for (std::uint32_t s = start[slot * kCellsPerBrick]; s < start[(slot + 1) * kCellsPerBrick]; ++s)
      radius(s, here_[s]);
  });
  for (std::size_t s = start[slots * kCellsPerBrick]; s < radii_.size(); ++s)  // strays
    radius(static_cast<std::uint32_t>(s), fill(grid_->center(static_cast<std::uint32_t>(s))));
}

void SnowField::find_kinds() {
  const std::size_t slots = grid_->brick_of_slot().size();
  kind_.assign(slots * 8, 0);
  parallel_for(slots, 32, [&](std::size_t slot) {
    for (int c = 0; c < kCellsPerBrick; ++c) {
      int in = 0;
      const float* corner =
          fill_.empty() ? nullptr : &fill_[slot * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
      for (int k = 0; k < 8 && corner != nullptr; ++k)
        in += corner[corner_index(k >> 2, k >> 1 & 1, k & 1)] >= kLevel;
      std::uint32_t kind = in == 0 ? kernels::kOutside : in == 8 ? kernels::kInside : kernels::kCrossed;
      if (grid_->view().list[slot * kCellsPerBrick + static_cast<std::size_t>(c)] != 0)
        kind |= kernels::kHasLoose;
      kind_[slot * 8 + static_cast<std::size_t>(c >> 3)] |= kind << (4 * (c & 7));
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

// Of each particle volume and mass, over the room of a cell; density and extinction from them.
void SnowField::weigh(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const double per_cell = std::pow(static_cast<double>(grid_->view().inv_cell), 3);
  const SnowLook first = looks.empty() ? SnowLook{} : looks.front();
  const auto each = [&](auto&& body) {
    parallel_chunks(grid_->size(), 8192, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t s = begin; s < end; ++s) {
        const std::uint32_t i = grid_->snapshot_index(static_cast<std::uint32_t>(s));
        const std::size_t object = snapshot.object[i];
        body(s, i, looks.empty() ? first : looks[std::min(object, looks.size() - 1)]);
      }
    });
  };
  volume_.resize(grid_->size()), mass_.resize(grid_->size());
  here_.resize(grid_->size());
  each([&](std::size_t s, std::uint32_t i, const SnowLook& look) {
    volume_[s] = static_cast<float>(snapshot.volume0[i] * per_cell);
    mass_[s] = static_cast<float>(volume_[s] * look.density);
  });
  splat(mass_, density_);
  const bool alike = std::all_of(looks.begin(), looks.end(),
                                 [&](const SnowLook& look) { return look.extinction == first.extinction; });
  sigma_.clear();
  extinction_ = alike ? static_cast<float>(first.extinction) : 1.f;
  if (alike) return;
  each([&](std::size_t s, std::uint32_t, const SnowLook& look) {
    mass_[s] *= static_cast<float>(look.extinction);
  });
  splat(mass_, sigma_);
}

// The balls of loose particles, and company for the others.
void SnowField::close_surface(RenderGrid& grid, const Snapshot& snapshot) {
  find_loose(snapshot);
  grid.set_radii(radii_);
  add_company();
  double loose = 0, room = 0;
  for (std::size_t s = 0; s < radii_.size(); ++s) {
    if (radii_[s] > 0) loose += mass_[s], room += volume_[s];
  }
  ball_density_ = room > 0 ? static_cast<float>(loose / room) : 0.f;
}

void SnowField::build(RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks,
                      SnowShape shape) {
  grid_ = &grid;
  weigh(snapshot, looks);
  fill_.clear();
  ball_density_ = -1;
  if (shape == SnowShape::smooth) {
    fill_.resize(density_.size());
    const double density = looks.empty() ? SnowLook{}.density : looks.front().density;
    // All of one density as placed: the fill is the density then, but for a factor.
    if (std::all_of(looks.begin(), looks.end(), [&](const auto& look) { return look.density == density; })) {
      const float by_mass = static_cast<float>(1 / density);
      parallel_chunks(fill_.size(), 1 << 16, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) fill_[c] = density_[c] * by_mass;
      });
    } else {
      splat(volume_, fill_);
    }
    close_surface(grid, snapshot);
  } else {
    grid.empty_unreached_lists();
  }
  find_kinds();
  close_bricks();
  measure_gradients();
  measure_strays(snapshot, looks);
  surface_ = {fill_.data(), kind_.data(), kLevel};
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

double SnowField::mass() const {
  // Of a trilinear field each cell holds its volume times the mean of its corners.
  double sum = 0;
  for (std::size_t cell = 0; cell < grid_->brick_of_slot().size() * kCellsPerBrick; ++cell) {
    const std::size_t slot = cell / kCellsPerBrick, c = cell % kCellsPerBrick;
    const float* corner =
        &density_[slot * kBrickCorners + corner_index(static_cast<int>(c >> 4), static_cast<int>(c >> 2 & 3),
                                                      static_cast<int>(c & 3))];
    for (int k = 0; k < 8; ++k) sum += corner[corner_index(k >> 2, k >> 1 & 1, k & 1)];
  }
  return sum / 8 * std::pow(static_cast<double>(grid_->view().cell), 3);
}

double SnowField::clipped_mass() const {
  constexpr int kPoints = 4;  // along each side of a cell
  double sum = 0;
  for (std::size_t slot = 0; slot < grid_->brick_of_slot().size(); ++slot) {
    for (int c = 0; c < kCellsPerBrick; ++c) {
      Place place{slot, {c >> 4, c >> 2 & 3, c & 3}, {}};
      for (int k = 0; k < kPoints * kPoints * kPoints; ++k) {
        const int at[3] = {k / (kPoints * kPoints), k / kPoints % kPoints, k % kPoints};
        for (int a = 0; a < 3; ++a) place.part[a] = (static_cast<float>(at[a]) + 0.5f) / kPoints;
        if (interpolate(fill_, place) >= kLevel) sum += interpolate(density_, place);
      }
    }
  }
  return sum * std::pow(static_cast<double>(grid_->view().cell) / kPoints, 3);
}

std::size_t SnowField::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(fill_) + of(density_) + of(kind_) + of(gradient_at_) + of(gradient_) + of(tile_) + of(tile_at_) +
         of(slot_) + of(sigma_) + of(stray_extinction_) + of(cells_) + of(depth_);
}

}  // namespace firn
