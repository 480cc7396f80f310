// SPDX-License-Identifier: MIT
#include "src/particles/sort.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <utility>

#include "firn/error.h"
#include "src/core/parallel.h"

namespace firn {

namespace {

constexpr int kInBlock = kernels::kCellBits + 2;  // bits of a position inside its block of four cells
constexpr int kGone = kernels::kNeighbours;       // destination of those who left

int cell_in_block(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto cell = [](std::int64_t p) { return static_cast<int>(p >> kernels::kCellBits) & 3; };
  return (cell(x) * 4 + cell(y)) * 4 + cell(z);
}

BlockCoord block_of(const LatticePoint& p) {
  const auto block = [](std::int64_t c) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(c >> kInBlock, INT32_MIN / 2, INT32_MAX / 2));
  };
  return {block(p.x), block(p.y), block(p.z)};
}

// A coordinate `lead` ahead.
std::int32_t ahead(std::int32_t x, float v, float lead) {
  return x + static_cast<std::int32_t>(v * (lead * kernels::kOneCell));
}

// A place inside a block, in quarters of a cell, an axis after the other.
constexpr int kQuarterBits = 4;
constexpr int kPlaceBits = 3 * kQuarterBits;
constexpr std::int32_t kQuarters = 1 << kQuarterBits;
static_assert(kQuarters == 4 * 4);

std::int32_t quarter_in_block(std::int32_t x) { return x >> (kInBlock - kQuarterBits) & (kQuarters - 1); }

// That of the greatest motion; z, on which a tile's nodes follow one another, if there is none.
int main_axis(const float (&motion)[3]) {
  int main = 2;
  for (const int axis : {1, 0}) {
    if (motion[axis] > motion[main]) main = axis;
  }
  return main;
}

// What the scratch column holds between two passes of a sort: the particle's number in its old block, and its
// place in the new one.
constexpr std::uint32_t kPlaceMask = (1u << kPlaceBits) - 1;
constexpr std::size_t kMostInBlock = std::size_t{1} << (32 - kPlaceBits);

// Where particles [begin, end) of one block go: the neighbour, then the place in it.
void find_destinations(const kernels::ParticleView& p, std::size_t begin, std::size_t end, float lead,
                       std::uint32_t* out) {
  for (std::size_t i = begin; i < end; ++i) {
    std::int32_t block = 0, place = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t x = ahead(p.x[axis][i], p.v[axis][i], lead);
      block = 3 * block + (x >> kInBlock) + 1;
      place = place << kQuarterBits | quarter_in_block(x);
    }
    assert(block >= 0 && block < kernels::kNeighbours);
    out[i - begin] = static_cast<std::uint32_t>(block << kPlaceBits | place);
  }
}

// The rows of a block's cells along one axis: a row's particles follow one another by the quarters of its
// four cells.
class Rows {
 public:
  static constexpr std::size_t kCount = 16 * kQuarters;
  explicit Rows(int axis) : along_(shift(axis)), across_{shift(axis == 0), shift(axis == 2 ? 1 : 2)} {}

  std::size_t operator()(std::uint32_t place) const {
    const auto quarter = [&](int at) { return place >> at & (kQuarters - 1); };
    return ((quarter(across_[0]) >> 2) * 4 + (quarter(across_[1]) >> 2)) * kQuarters + quarter(along_);
  }

 private:
  static int shift(int axis) { return (2 - axis) * kQuarterBits; }
  int along_, across_[2];
};

}  // namespace

std::optional<std::size_t> find_block(const std::vector<BlockKey>& keys, BlockKey key) {
  const auto at = std::lower_bound(keys.begin(), keys.end(), key);
  if (at == keys.end() || *at != key) return std::nullopt;
  return static_cast<std::size_t>(at - keys.begin());
}

std::vector<std::uint32_t> place_in_blocks(std::size_t count,
                                           const std::function<LatticePoint(std::size_t)>& place, double dx,
                                           ParticleBlocks& blocks) {
  struct Entry {
    std::uint64_t key;  // block, then cell
    std::uint32_t index;
  };
  std::vector<Entry> entries(count);
  parallel_for(count, 4096, [&](std::size_t i) {
    const LatticePoint p = place(i);
    const BlockCoord b = block_of(p);
    const std::uint64_t key = addressable(b) ? block_key(b) : ~std::uint64_t{0} >> 6;
    entries[i] = {key << 6 | static_cast<std::uint64_t>(cell_in_block(p.x, p.y, p.z)),
                  static_cast<std::uint32_t>(i)};
  });
  parallel_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.key != b.key ? a.key < b.key : a.index < b.index;
  });

  blocks = {};
  std::vector<std::uint32_t> order(count);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    order[i] = entries[i].index;
    const BlockKey key = entries[i].key >> 6;
    if (!blocks.key.empty() && blocks.key.back() == key) continue;
    const BlockCoord coord = block_of(place(order[i]));
    if (!addressable(coord)) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "snow lies more than %.3g m from the origin, the end of the grid at dx = %.3g m",
                    4 * dx * (kBlockReach - 1), dx);
      throw Error(ErrorCode::usage, "", text);
    }
    blocks.key.push_back(key);
    blocks.coord.push_back(coord);
    blocks.begin.push_back(i);
  }
  blocks.begin.push_back(count);
  blocks.calm.assign(blocks.size(), 0.f);
  return order;
}

void BlockSorter::group_by_destination(ParticleColumns& particles, const ParticleBlocks& blocks,
                                       const Leavers& leavers, float lead) {
  const kernels::ParticleView p = particles.view();
  std::uint32_t* const grouped = particles.scratch();
  flows_of_block_.resize(blocks.size());
  parallel_for(blocks.size(), 4, [&](std::size_t b) {
    const std::size_t begin = blocks.begin[b], end = blocks.begin[b + 1], count = end - begin;
    if (count > kMostInBlock) {
      throw Error(ErrorCode::unstable, "",
                  std::to_string(count) + " particles share one block of 4x4x4 cells");
    }
    thread_local std::vector<std::uint32_t> destination;
    destination.resize(count);
    find_destinations(p, begin, end, lead, destination.data());
    if (leavers.may_lose && leavers.may_lose(blocks.coord[b])) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::int32_t x[3] = {p.x[0][i], p.x[1][i], p.x[2][i]};
        if (leavers.is_gone(blocks.coord[b], x)) destination[i - begin] = kGone << kPlaceBits;
      }
    }
    const auto where = [&](std::size_t k) { return destination[k] >> kPlaceBits; };
    std::array<std::size_t, kGone + 2> at{};  // counts, then where the next particle of a destination goes
    for (std::size_t k = 0; k < count; ++k) ++at[where(k) + 1];
    at[0] = begin;
    auto& flows = flows_of_block_[b];
    flows.clear();
    for (int n = 0; n <= kGone; ++n) {
      at[n + 1] += at[n];
      if (n == kGone || at[n] == at[n + 1]) continue;
      const BlockCoord to = neighbour(blocks.coord[b], n);
      flows.push_back({addressable(to) ? block_key(to) : ~BlockKey{0}, to, static_cast<std::uint32_t>(b),
                       begin, at[n], at[n + 1]});
    }
    for (std::size_t k = 0; k < count; ++k) {
      grouped[at[where(k)]++] = static_cast<std::uint32_t>(k) << kPlaceBits | (destination[k] & kPlaceMask);
    }
  });
}

void BlockSorter::cut_new_blocks(ParticleBlocks& blocks) {
  flows_.clear();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    flows_.insert(flows_.end(), flows_of_block_[b].begin(), flows_of_block_[b].end());
  }
  parallel_sort(flows_.begin(), flows_.end(),
                [](const Flow& a, const Flow& b) { return a.to != b.to ? a.to < b.to : a.first < b.first; });
  if (!flows_.empty() && flows_.back().to == ~BlockKey{0}) {
    throw Error(ErrorCode::unstable, "",
                "snow has travelled to the end of the grid, " + std::to_string(4 * kBlockReach) +
                    " cells from the origin: give the scene a domain or a floor");
  }
  const std::vector<float> old_calm = std::exchange(blocks.calm, {});
  blocks.coord.clear();
  blocks.key.clear();
  blocks.begin.assign(1, 0);
  first_flow_.clear();
  std::size_t count = 0;
  for (std::size_t f = 0; f < flows_.size(); ++f) {
    if (f == 0 || flows_[f].to != flows_[f - 1].to) {
      if (f != 0) blocks.begin.push_back(count);
      blocks.coord.push_back(flows_[f].coord);
      blocks.key.push_back(flows_[f].to);
      blocks.calm.push_back(old_calm[flows_[f].from]);
      first_flow_.push_back(f);
    }
    blocks.calm.back() = std::min(blocks.calm.back(), old_calm[flows_[f].from]);
    count += flows_[f].end - flows_[f].begin;
  }
  if (!flows_.empty()) blocks.begin.push_back(count);
  first_flow_.push_back(flows_.size());
}

void BlockSorter::order_rows(ParticleColumns& particles, const ParticleBlocks& blocks) {
  const kernels::ParticleView p = particles.view();
  const std::uint32_t* const grouped = particles.scratch();
  order_.resize(blocks.begin.back());
  parallel_for(blocks.size(), 4, [&](std::size_t b) {
    const auto for_each = [&](auto&& f) {  // old number, place in the new block
      for (std::size_t k = first_flow_[b]; k < first_flow_[b + 1]; ++k) {
        const Flow& flow = flows_[k];
        for (std::size_t i = flow.begin; i < flow.end; ++i)
          f(static_cast<std::uint32_t>(flow.first + (grouped[i] >> kPlaceBits)), grouped[i] & kPlaceMask);
      }
    };
    float motion[3] = {0, 0, 0};
    for_each([&](std::uint32_t particle, std::uint32_t) {
      for (int axis = 0; axis < 3; ++axis) motion[axis] += std::fabs(p.v[axis][particle]);
    });
    const Rows row(main_axis(motion));
    std::array<std::size_t, Rows::kCount + 1> at{};
    for_each([&](std::uint32_t, std::uint32_t place) { ++at[row(place) + 1]; });
    at[0] = blocks.begin[b];
    for (std::size_t r = 0; r < Rows::kCount; ++r) at[r + 1] += at[r];
    for_each([&](std::uint32_t particle, std::uint32_t place) { order_[at[row(place)]++] = particle; });
  });
}

std::size_t BlockSorter::sort(ParticleColumns& particles, ParticleBlocks& blocks, const Leavers& leavers,
                              float lead) {
  const std::size_t before = particles.size();
  group_by_destination(particles, blocks, leavers, lead);
  cut_new_blocks(blocks);
  order_rows(particles, blocks);
  particles.permute(order_);
  const kernels::ParticleView p = particles.view();
  parallel_chunks(particles.size(), 16384, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = begin; i < end; ++i)  // now from the new block's corner
        p.x[axis][i] -= ahead(p.x[axis][i], p.v[axis][i], lead) & -(1 << kInBlock);
    }
  });
  return before - particles.size();
}

std::size_t BlockSorter::resident_bytes() const {
  std::size_t bytes = order_.capacity() * sizeof(std::uint32_t) + flows_.capacity() * sizeof(Flow) +
                      first_flow_.capacity() * sizeof(std::size_t);
  for (const auto& flows : flows_of_block_)
    bytes += sizeof(std::vector<Flow>) + flows.capacity() * sizeof(Flow);
  return bytes;
}

}  // namespace firn
