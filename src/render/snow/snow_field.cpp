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
// A particle whose place is filled less than this counts as much more as it lacks, up to a limit: snow that
// is stretched to kCompany / kMostCompany of its density stays closed.
constexpr float kCompany = 0.55f, kMostCompany = 6.0f;
constexpr int kCompanyRounds = 3;
// Spacings: the ball of a particle's own volume. A particle that is alone fills its place by kLone at most;
// the ball shrinks as the others fill more of it, up to kCovered, where the surface takes over.
constexpr float kLooseRadius = 0.62f, kLone = 0.11f, kCovered = 0.2f, kCoveredRadius = 0.1f;

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

// Adds the tiles that reach each brick's corners to them, always in the same order.
void SnowField::gather_corners(std::vector<float>& corners) const {
  parallel_for(grid_->brick_of_slot().size(), 16, [&](std::size_t slot) {
    const float* tiles[27];
    bool any = false;
    for (int k = 0; k < 27; ++k) {
      const std::int32_t other = neighbours_[slot][k];
      const bool there = other >= 0 && tile_at_[other] != kNone;
      tiles[k] = there ? &tile_[static_cast<std::size_t>(tile_at_[other]) * kFieldTile] : nullptr;
      any = any || there;
    }
    if (any) kernels_.sum_tiles(tiles, &corners[slot * kBrickCorners]);
  });
}

void SnowField::splat(const std::vector<float>& amount, std::vector<float>& corners) {
  const std::size_t slots = grid_->brick_of_slot().size();
  const std::uint32_t* start = grid_->view().cell_start;
  corners.resize(slots * kBrickCorners);
  parallel_chunks(corners.size(), 1 << 16, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::fill(corners.data() + begin, corners.data() + end, 0.f);
  });
  splats_.resize(slots);
  for (std::size_t slot = 0; slot < slots; ++slot)
    splats_[slot] = start[slot * kCellsPerBrick] < start[(slot + 1) * kCellsPerBrick];
  splat_bricks(amount);
  gather_corners(corners);
}

// Of all corners of a brick.
SnowField::Span SnowField::fill_span(std::size_t slot) const {
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
  return {*std::min_element(least, least + kSide), *std::max_element(most, most + kSide)};
}

// Whether the fill is at least so much at the corners of all cells that hold particles.
bool SnowField::filled(std::size_t slot, float enough) const {
  return fill_span(slot).least >= enough || least_fill(slot) >= enough;
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
  counts_.resize(volume_.size());
  more_.resize(volume_.size());
  std::vector<std::uint8_t> done(slots, 0);  // what is filled stays so
  for (int round = 0; round < kCompanyRounds; ++round) {
    parallel_for(slots, 16, [&](std::size_t slot) {
      splats_[slot] = 0;
      done[slot] = done[slot] || filled(slot, kCompany);
      if (done[slot]) return;
      fill_at_particles(slot);
      const std::uint32_t begin = grid.cell_start[slot * kCellsPerBrick],
                          end = grid.cell_start[(slot + 1) * kCellsPerBrick];
      if (round == 0) std::fill(counts_.data() + begin, counts_.data() + end, 1.f);
      for (std::uint32_t s = begin; s < end; ++s) {
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
    gather_corners(fill_);
  }
}

// The ball that each particle is beside the surface.
void SnowField::find_loose(const Snapshot& snapshot) {
  const std::uint32_t* start = grid_->view().cell_start;
  radii_.resize(grid_->size());
  const std::size_t slots = grid_->brick_of_slot().size();
  const auto radius = [&](std::uint32_t s, float here) {
    if (here >= kCovered) return;
    const float part = std::max(here - kLone, 0.f) / (kCovered - kLone);
    const float share = kLooseRadius + (kCoveredRadius - kLooseRadius) * part;
    radii_[s] = share * static_cast<float>(portable_cbrt(snapshot.volume0[grid_->snapshot_index(s)]));
  };
  parallel_for(slots, 16, [&](std::size_t slot) {
    const std::uint32_t begin = start[slot * kCellsPerBrick], end = start[(slot + 1) * kCellsPerBrick];
    std::fill(radii_.data() + begin, radii_.data() + end, -1.f);
    if (filled(slot, kCovered)) return;
    fill_at_particles(slot);
    for (std::uint32_t s = begin; s < end; ++s) radius(s, here_[s]);
  });
  const std::size_t strays = start[slots * kCellsPerBrick];
  std::fill(radii_.begin() + static_cast<std::ptrdiff_t>(strays), radii_.end(), -1.f);
  for (std::size_t s = strays; s < radii_.size(); ++s)
    radius(static_cast<std::uint32_t>(s), fill(grid_->center(static_cast<std::uint32_t>(s))));
}

// By the corners of a cell.
std::uint32_t SnowField::surface_kind(std::size_t slot, int c) const {
  const float* corner = &fill_[slot * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
  int in = 0;
  for (int k = 0; k < 8; ++k) in += corner[corner_index(k >> 2, k >> 1 & 1, k & 1)] >= kLevel;
  return in == 0 ? kernels::kOutside : in == 8 ? kernels::kInside : kernels::kCrossed;
}

void SnowField::find_kinds() {
  const std::size_t slots = grid_->brick_of_slot().size();
  kind_.resize(slots * 8);
  parallel_for(slots, 32, [&](std::size_t slot) {
    std::uint32_t* words = &kind_[slot * 8];
    const Span span = fill_.empty() ? Span{} : fill_span(slot);
    const bool crossed = span.least < kLevel && span.most >= kLevel;
    std::fill(words, words + 8, span.least >= kLevel ? kernels::kInside * 0x11111111u : 0);
    const std::uint32_t* list = &grid_->view().list[slot * kCellsPerBrick];
    for (int c = 0; c < kCellsPerBrick; ++c) {
      const std::uint32_t kind =
          (crossed ? surface_kind(slot, c) : 0u) | (list[c] != 0 ? std::uint32_t{kernels::kHasLoose} : 0u);
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
  optical_.resize(grid_->size());
  each([&](std::size_t s, std::uint32_t, const SnowLook& look) {
    optical_[s] = mass_[s] * static_cast<float>(look.extinction);
  });
  splat(optical_, sigma_);
}

// The balls of loose particles, and company for the others.
void SnowField::close_surface(RenderGrid& grid, const Snapshot& snapshot) {
  find_loose(snapshot);
  grid.set_radii(radii_);
  add_company();
  constexpr std::size_t kChunk = 8192;
  struct Sum {
    double mass = 0, optical = 0, room = 0;
  };
  const std::vector<float>& optical = sigma_.empty() ? mass_ : optical_;
  std::vector<Sum> sums((radii_.size() + kChunk - 1) / kChunk);
  parallel_chunks(radii_.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
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

std::size_t SnowField::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(fill_) + of(density_) + of(kind_) + of(gradient_at_) + of(gradient_) + of(tile_) + of(tile_at_) +
         of(slot_) + of(sigma_) + of(stray_extinction_) + of(cells_) + of(depth_);
}

}  // namespace firn
