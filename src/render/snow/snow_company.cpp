// SPDX-License-Identifier: MIT
// Where snow is thin: particles that are all but alone become balls, and those with little company count for
// more, so that snow which stretches stays closed until it tears. Most bricks are filled, and need neither:
// that is told by what the fill is at least, at all corners or at those of cells that hold particles.
#include <algorithm>
#include <limits>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"
#include "src/render/snow/snow_field.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kBrickCorners;
using kernels::kCellsPerBrick;
using kernels::kCornerSide;

// A particle whose place is filled less than this counts as much more as it lacks, up to a limit: snow that
// is stretched to kCompany / kMostCompany of its density stays closed.
constexpr float kCompany = 0.55f, kMostCompany = 6.0f;
constexpr int kCompanyRounds = 3;
// Spacings: the ball of a particle's own volume. A particle that is alone fills its place by kLone at most;
// the ball shrinks as the others fill more of it, up to kCovered, where the surface takes over.
constexpr float kLooseRadius = 0.62f, kLone = 0.11f, kCovered = 0.2f, kCoveredRadius = 0.1f;

// Of each cell of a brick the least (or by `less` the most) of its corners: along z, then y, then x.
template <class Less>
void reduce_cells(const float* corner, Less less, float* out) {
  constexpr int kSide = kBrickCells;
  float along_z[kCornerSide * kCornerSide][kSide], along_y[kCornerSide * kSide][kSide];
  const auto of = [less](float a, float b) { return less(b, a) ? b : a; };
  for (int row = 0; row < kCornerSide * kCornerSide; ++row) {
    const float* in = corner + row * kCornerSide;
    for (int z = 0; z < kSide; ++z) along_z[row][z] = of(in[z], in[z + 1]);
  }
  for (int row = 0; row < kCornerSide * kSide; ++row) {
    const int from = row / kSide * kCornerSide + row % kSide;
    for (int z = 0; z < kSide; ++z) along_y[row][z] = of(along_z[from][z], along_z[from + 1][z]);
  }
  for (int row = 0; row < kSide * kSide; ++row) {
    for (int z = 0; z < kSide; ++z) out[row * kSide + z] = of(along_y[row][z], along_y[row + kSide][z]);
  }
}

}  // namespace

SnowField::CellSpans SnowField::cell_spans(std::size_t slot) const {
  CellSpans spans;
  reduce_cells(&fill_[slot * kBrickCorners], std::less<float>(), spans.least);
  reduce_cells(&fill_[slot * kBrickCorners], std::greater<float>(), spans.most);
  return spans;
}

// Whether the fill is at least so much at the corners of all cells that hold particles.
bool SnowField::filled(std::size_t slot, float enough) const {
  if (spans_[slot].least >= enough) return true;
  float least[kCellsPerBrick];
  reduce_cells(&fill_[slot * kBrickCorners], std::less<float>(), least);
  const std::uint64_t occupied = grid_->occupied(slot);
  bool all = true;
  for (int c = 0; c < kCellsPerBrick; ++c) all = all && (least[c] >= enough || (occupied >> c & 1) == 0);
  return all;
}

void SnowField::fill_at_particles(std::size_t slot) {
  const kernels::TraceGrid& grid = grid_->view();
  const kernels::ProbeView at{{grid.x, grid.y, grid.z}, {grid.x, grid.y, grid.z}};
  kernels_.probe(grid, fill_.data(), at, 0, grid.cell_start[slot * kCellsPerBrick],
                 grid.cell_start[(slot + 1) * kCellsPerBrick], here_.data());
}

// The ball that each particle is beside the surface. Leaves in here_ the fill at the particles of bricks that
// are not covered.
void SnowField::find_loose(const Snapshot& snapshot) {
  const std::uint32_t* start = grid_->view().cell_start;
  radii_.resize(grid_->size()), here_.resize(grid_->size());
  const std::size_t slots = grid_->brick_of_slot().size();
  covered_.resize(slots);
  const auto radius = [&](std::uint32_t s, float here) {
    if (here >= kCovered) return;
    const float part = std::max(here - kLone, 0.f) / (kCovered - kLone);
    const float share = kLooseRadius + (kCoveredRadius - kLooseRadius) * part;
    radii_[s] = share * static_cast<float>(portable_cbrt(snapshot.volume0[grid_->snapshot_index(s)]));
  };
  parallel_for(slots, 16, [&](std::size_t slot) {
    const std::uint32_t begin = start[slot * kCellsPerBrick], end = start[(slot + 1) * kCellsPerBrick];
    std::fill(radii_.data() + begin, radii_.data() + end, -1.f);
    covered_[slot] = begin == end || filled(slot, kCovered);
    if (covered_[slot]) return;
    fill_at_particles(slot);
    for (std::uint32_t s = begin; s < end; ++s) radius(s, here_[s]);
  });
  const std::size_t strays = start[slots * kCellsPerBrick];
  std::fill(radii_.begin() + static_cast<std::ptrdiff_t>(strays), radii_.end(), -1.f);
  for (std::size_t s = strays; s < radii_.size(); ++s)
    radius(static_cast<std::uint32_t>(s), fill(grid_->center(static_cast<std::uint32_t>(s))));
}

// Adds to the fill what particles with little company count for more. What one adds, its neighbours feel: a
// few rounds bring most places to kCompany.
void SnowField::add_company() {
  const std::uint32_t* start = grid_->view().cell_start;
  const std::size_t slots = grid_->brick_of_slot().size();
  counts_.resize(volume_.size());
  more_.resize(volume_.size());
  std::vector<std::uint8_t> done(slots, 0);  // what has company or all that it can get keeps it
  for (int round = 0; round < kCompanyRounds; ++round) {
    parallel_for(slots, 16, [&](std::size_t slot) {
      splats_[slot] = 0;
      const std::uint32_t begin = start[slot * kCellsPerBrick], end = start[(slot + 1) * kCellsPerBrick];
      done[slot] = done[slot] || begin == end || filled(slot, kCompany);
      if (done[slot]) return;
      if (round > 0 || covered_[slot]) fill_at_particles(slot);
      if (round == 0) std::fill(counts_.data() + begin, counts_.data() + end, 1.f);
      for (std::uint32_t s = begin; s < end; ++s) {
        more_[s] = 0;
        if (!(here_[s] < kCompany) || counts_[s] >= kMostCompany) continue;
        const float wanted = std::min(counts_[s] * kCompany / std::max(here_[s], 1e-3f), kMostCompany);
        more_[s] = volume_[s] * (wanted - counts_[s]);
        counts_[s] = wanted;
        splats_[slot] = 1;
      }
      done[slot] = !splats_[slot];
    });
    if (!add_to_fill(more_)) return;
  }
}

}  // namespace firn
