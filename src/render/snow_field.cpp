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
using kernels::kCornerSide;
using kernels::kFieldTile;
using kernels::kFieldTileRow;
using kernels::kFieldTileSide;

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr float kLevel = 0.5f;
// A particle whose place is filled less than this counts as much more as it lacks, up to a limit: snow that
// is stretched to kCompany / kMostCompany of its density stays closed.
constexpr float kCompany = 0.55f, kMostCompany = 6.0f;
constexpr int kCompanyRounds = 3;
// Spacings: the ball of a particle's own volume. A particle that is alone fills its place by kLone at most;
// the ball shrinks as the others fill more of it, up to kCovered, where the surface takes over.
constexpr float kLooseRadius = 0.62f, kLone = 0.11f, kCovered = 0.2f, kCoveredRadius = 0.1f;

int tile_index(int x, int y, int z) {  // from -1
  return ((x + 1) * kFieldTileSide + y + 1) * kFieldTileRow + z + 1;
}

}  // namespace

// The slot of the k-th of the 27 bricks around, or SIZE_MAX.
std::size_t SnowField::around(std::size_t slot, int k) const {
  const kernels::TraceGrid& grid = grid_->view();
  int p[3];
  brick_place(grid, grid_->brick_of_slot()[slot], p);
  const int step[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
  for (int a = 0; a < 3; ++a) {
    p[a] += step[a];
    if (p[a] < 0 || p[a] >= grid.bricks[a]) return SIZE_MAX;
  }
  const std::int32_t its = grid.slot[brick_index(grid, p[0], p[1], p[2])];
  return its < 0 ? SIZE_MAX : static_cast<std::size_t>(its);
}

// Each brick that holds particles of a non-zero amount gets a tile.
void SnowField::splat_bricks(const std::vector<float>& amount) {
  const kernels::TraceGrid& grid = grid_->view();
  const std::size_t slots = grid_->brick_of_slot().size();
  tile_at_.assign(slots, kNone);
  parallel_for(slots, 64, [&](std::size_t slot) {
    const std::uint32_t begin = grid.cell_start[slot * kCellsPerBrick],
                        end = grid.cell_start[(slot + 1) * kCellsPerBrick];
    for (std::uint32_t s = begin; s < end; ++s) {
      if (amount[s] == 0) continue;
      tile_at_[slot] = 0;
      break;
    }
  });
  std::uint32_t tiles = 0;
  for (std::uint32_t& at : tile_at_) {
    if (at != kNone) at = tiles++;
  }
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
    for (int k = 0; k < 27; ++k) {
      const std::size_t other = around(slot, k);
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
          const float* row =
              tile + tile_index(x - kBrickCells * step[0], y - kBrickCells * step[1], -kBrickCells * step[2]);
          float* to = out + corner_index(x, y, 0);
          for (int z = low[2]; z <= high[2]; ++z) to[z] += row[z];
        }
      }
    }
  });
}

void SnowField::splat(const std::vector<float>& amount, std::vector<float>& corners) {
  corners.resize(grid_->brick_of_slot().size() * kBrickCorners);
  splat_bricks(amount);
  gather_corners(corners, false);
}

// Adds to the fill what particles with little company count for more. What one adds, its neighbours feel: a
// few rounds bring most places to kCompany.
void SnowField::add_company(const std::vector<float>& volume) {
  const kernels::TraceGrid& grid = grid_->view();
  const std::size_t slots = grid_->brick_of_slot().size();
  std::vector<float> counts(volume.size(), 1.f), more(volume.size());
  for (int round = 0; round < kCompanyRounds; ++round) {
    std::fill(more.begin(), more.end(), 0.f);
    parallel_for(slots, 16, [&](std::size_t slot) {
      for (int c = 0; c < kCellsPerBrick; ++c) {
        const std::size_t cell = slot * kCellsPerBrick + static_cast<std::size_t>(c);
        if (grid.cell_start[cell] == grid.cell_start[cell + 1]) continue;
        const float* corner = &fill_[slot * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
        float least = corner[0];
        for (int k = 1; k < 8; ++k) least = std::min(least, corner[corner_index(k >> 2, k >> 1 & 1, k & 1)]);
        if (least >= kCompany) continue;
        for (std::uint32_t s = grid.cell_start[cell]; s < grid.cell_start[cell + 1]; ++s) {
          const float here = fill(grid_->center(s));
          if (!(here < kCompany) || counts[s] >= kMostCompany) continue;
          const float wanted = std::min(counts[s] * kCompany / std::max(here, 1e-3f), kMostCompany);
          more[s] = volume[s] * (wanted - counts[s]);
          counts[s] = wanted;
        }
      }
    });
    splat_bricks(more);
    if (tile_.empty()) return;
    gather_corners(fill_, true);
  }
}

// m, by sorted index: of the ball that a particle is beside the surface; -1 for one that the surface covers.
std::vector<float> SnowField::loose_radii(const Snapshot& snapshot) const {
  std::vector<float> radii(grid_->size(), -1.f);
  parallel_chunks(radii.size(), 8192, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto s = static_cast<std::uint32_t>(k);
      const float here = fill(grid_->center(s));
      if (here >= kCovered) continue;
      const float part = std::max(here - kLone, 0.f) / (kCovered - kLone);
      const float share = kLooseRadius + (kCoveredRadius - kLooseRadius) * part;
      radii[s] = share * static_cast<float>(portable_cbrt(snapshot.volume0[grid_->snapshot_index(s)]));
    }
  });
  return radii;
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

// Central differences, smoothed across (Sobel), at the corners of the bricks that the surface crosses.
void SnowField::measure_gradients() {
  const std::size_t slots = grid_->brick_of_slot().size();
  gradient_at_.assign(slots, kNone);
  std::uint32_t crossed = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    std::uint32_t any = 0;
    for (std::size_t w = 0; w < 8; ++w) any |= kind_[slot * 8 + w] & 0x11111111u;
    if (any != 0) gradient_at_[slot] = crossed++;
  }
  gradient_.resize(static_cast<std::size_t>(crossed) * 3 * kBrickCorners);
  const float per_metre = 0.5f * grid_->view().inv_cell;
  parallel_for(slots, 16, [&](std::size_t slot) {
    if (gradient_at_[slot] == kNone) return;
    std::size_t other[27];
    for (int k = 0; k < 27; ++k) other[k] = around(slot, k);
    // Corners -1..5 of this brick, from the bricks that hold them.
    float block[kFieldTile];
    for (int c = 0; c < kFieldTileSide * kFieldTileSide * kFieldTileSide; ++c) {
      const int p[3] = {c / (kFieldTileSide * kFieldTileSide) - 1, c / kFieldTileSide % kFieldTileSide - 1,
                        c % kFieldTileSide - 1};
      int q[3], k = 0;
      for (int a = 0; a < 3; ++a) {
        const int step = p[a] < 0 ? -1 : p[a] > kBrickCells ? 1 : 0;
        q[a] = p[a] - kBrickCells * step;
        k = 3 * k + step + 1;
      }
      block[tile_index(p[0], p[1], p[2])] =
          other[k] == SIZE_MAX ? 0.f : fill_[other[k] * kBrickCorners + corner_index(q[0], q[1], q[2])];
    }
    float* out = &gradient_[static_cast<std::size_t>(gradient_at_[slot]) * 3 * kBrickCorners];
    for (int c = 0; c < kBrickCorners; ++c) {
      const int at =
          tile_index(c / (kCornerSide * kCornerSide), c / kCornerSide % kCornerSide, c % kCornerSide);
      float sum[3] = {0, 0, 0};
      for (int k = 0; k < 27; ++k) {
        const int d[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
        const float v = block[at + (d[0] * kFieldTileSide + d[1]) * kFieldTileRow + d[2]];
        for (int a = 0; a < 3; ++a) {
          const int u = (a + 1) % 3, w = (a + 2) % 3;
          sum[a] += static_cast<float>(d[a] * (2 - d[u] * d[u]) * (2 - d[w] * d[w])) * v;
        }
      }
      for (int a = 0; a < 3; ++a) out[3 * c + a] = sum[a] * per_metre / 16;
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

void SnowField::build(RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks,
                      SnowShape shape) {
  grid_ = &grid;
  const std::size_t count = grid.size();
  const double per_cell = std::pow(static_cast<double>(grid.view().inv_cell), 3);
  std::vector<float> volume(count), mass(count);
  // All of one density as placed: the fill is the density then, but for a factor.
  bool alike = true, alike_in_light = true;
  const SnowLook first = looks.empty() ? SnowLook{} : looks.front();
  for (const SnowLook& look : looks) {
    alike = alike && look.density == first.density;
    alike_in_light = alike_in_light && look.extinction == first.extinction;
  }
  const auto each = [&](auto&& body) {
    parallel_chunks(count, 8192, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t s = begin; s < end; ++s) {
        const std::uint32_t i = grid.snapshot_index(static_cast<std::uint32_t>(s));
        const std::size_t object = snapshot.object[i];
        body(s, i, looks.empty() ? first : looks[std::min(object, looks.size() - 1)]);
      }
    });
  };
  each([&](std::size_t s, std::uint32_t i, const SnowLook& look) {
    volume[s] = static_cast<float>(snapshot.volume0[i] * per_cell);
    mass[s] = static_cast<float>(volume[s] * look.density);
  });
  splat(mass, density_);
  sigma_.clear();
  extinction_ = alike_in_light ? static_cast<float>(first.extinction) : 1.f;
  if (!alike_in_light) {
    each([&](std::size_t s, std::uint32_t, const SnowLook& look) {
      mass[s] *= static_cast<float>(look.extinction);
    });
    splat(mass, sigma_);
  }
  fill_.clear();
  ball_density_ = -1;
  if (shape == SnowShape::smooth) {
    fill_.resize(density_.size());
    if (alike) {
      const float by_mass = static_cast<float>(1 / first.density);
      parallel_chunks(fill_.size(), 1 << 16, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) fill_[c] = density_[c] * by_mass;
      });
    } else {
      splat(volume, fill_);
    }
    const std::vector<float> radii = loose_radii(snapshot);
    grid.set_radii(radii);
    add_company(volume);
    double loose = 0, room = 0;
    for (std::size_t s = 0; s < count; ++s) {
      if (radii[s] > 0) loose += mass[s], room += volume[s];
    }
    ball_density_ = room > 0 ? static_cast<float>(loose / room) : 0.f;
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

Vec3f SnowField::normal(const Vec3f& p, const Vec3f& otherwise) const {
  Place place;
  if (!find(p, place) || gradient_at_[place.slot] == kNone) return otherwise;
  const float* corner = &gradient_[(static_cast<std::size_t>(gradient_at_[place.slot]) * kBrickCorners +
                                    corner_index(place.cell[0], place.cell[1], place.cell[2])) *
                                   3];
  Vec3f sum = Vec3f::Zero();
  for (int k = 0; k < 8; ++k) {
    const int x = k >> 2, y = k >> 1 & 1, z = k & 1;
    const float weight = (x ? place.part[0] : 1 - place.part[0]) * (y ? place.part[1] : 1 - place.part[1]) *
                         (z ? place.part[2] : 1 - place.part[2]);
    const float* g = corner + 3 * corner_index(x, y, z);
    sum -= weight * Vec3f(g[0], g[1], g[2]);
  }
  const float length = sum.norm();
  return length > 1e-12f ? Vec3f(sum / length) : otherwise;
}

std::uint32_t SnowField::particle_near(const Vec3f& p) const {
  const kernels::TraceGrid& grid = grid_->view();
  int cell[3];
  for (int a = 0; a < 3; ++a)
    cell[a] = static_cast<int>(std::clamp(p[a] * grid.inv_cell, 0.f, static_cast<float>(grid.cells[a] - 1)));
  std::uint32_t best = kernels::kNoHit;
  float least = std::numeric_limits<float>::infinity();
  for (int k = 0; k < 27; ++k) {
    const std::size_t near =
        cell_index(grid, cell[0] + k / 9 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k % 3 - 1);
    if (near == kNoCell) continue;
    for (std::uint32_t s = grid.cell_start[near]; s < grid.cell_start[near + 1]; ++s) {
      const float distance = (grid_->center(s) - p).squaredNorm();
      if (distance < least) least = distance, best = s;
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
         of(slot_) + of(sigma_) + of(stray_extinction_) + of(majorant_) + of(depth_);
}

}  // namespace firn
