// SPDX-License-Identifier: MIT
// Which points of the snow may glint: one in some hundred does, so what is asked of all is only whether a
// facet lies there that is turned about right; src/render/snow/sparkle.h has the light. Points are turned
// into their particles' frames, a register at a time, and told which cells of place and direction to ask.
// Those of one particle ask for much the same cells, so they ask together: hashes, whose lanes are cells, say
// which hold facets and where, and each facet is broadcast against the points. Bounds are a little wider than
// the facets' own, for rounding.
#include "kernels/shade/table.h"
#include "kernels/simd/hash.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr int kWindow = 64;                       // points that may ask together
constexpr int kMostPlaces = 64, kMostTurns = 64;  // cells that they may ask for
constexpr int kMostFacets = 256;                  // in a cell
constexpr int kMostWaiting = 64;                  // cells that have facets
constexpr float kMargin = 1.001f;                 // of lengths
constexpr float kWidest = 4;  // light cones, in cones of a facet, beyond which their mean shines

struct Three {
  Floats of[3];
};

FIRN_INLINE Three load3(const Columns3& columns, std::size_t i, int count, float fill) {
  return {{load_first(columns.at[0] + i, count, fill), load_first(columns.at[1] + i, count, fill),
           load_first(columns.at[2] + i, count, fill)}};
}
FIRN_INLINE Floats dot(const Three& a, const Three& b) {
  return fma(a.of[2], b.of[2], fma(a.of[1], b.of[1], a.of[0] * b.of[0]));
}
FIRN_INLINE Three cross(const Three& a, const Three& b) {
  Three c;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    c.of[i] = a.of[j] * b.of[k] - a.of[k] * b.of[j];
  }
  return c;
}

// Into the frame of a particle that has turned by q = axis tan(angle / 4):
// v + (8 q x (q x v) - 4 (1 - q^2) q x v) / (1 + q^2)^2.
FIRN_INLINE Three turn_back(const Three& q, Floats q2, const Three& v) {
  const Three once = cross(q, v), twice = cross(q, once);
  const Floats by = 1 / ((1 + q2) * (1 + q2));
  Three out;
  for (int a = 0; a < 3; ++a) out.of[a] = v.of[a] + (8 * twice.of[a] - 4 * (1 - q2) * once.of[a]) * by;
  return out;
}

FIRN_INLINE Ints floor_to_ints(Floats a) {
  const Ints towards_zero = __builtin_convertvector(a, Ints);
  return select(less(a, to_float(towards_zero)), towards_zero - 1, towards_zero);
}

// What the points of a window ask of the facets.
struct Asked {
  alignas(64) std::int32_t id[kWindow];
  alignas(64) std::int32_t low[3][kWindow], high[3][kWindow];  // cells of place
  alignas(64) std::int32_t first[6][2][kWindow],
      last[6][2][kWindow];                               // of direction, for each face of a cube
  std::uint64_t on_face[6];                              // points that ask there, a bit each
  alignas(64) float at[3][kWindow], normal[3][kWindow];  // in the particle's frame
  alignas(64) float shrunk[kWindow], box[3][kWindow];    // box: m, to either side of `at`
};

// As FacetField::cells_of_face.
FIRN_INLINE void ask_face(const FacetCells& facets, int face, const Three& half, Floats chord, Mask lanes,
                          int begin, Asked& asked) {
  const int axis = face >> 1;
  const Floats along = face & 1 ? -half.of[axis] : half.of[axis];
  const Floats most = along + chord, least = max(along - chord, splat(0.577f));
  Mask there = lanes & less_equal(least, most);
  if (!any(there)) return;
  for (int k = 0; k < 2; ++k) {
    const Floats across = half.of[(axis + 1 + k) % 3], low = across - chord, high = across + chord;
    const Floats u0 = low / select(less(low, splat(0)), least, most);
    const Floats u1 = high / select(less(high, splat(0)), most, least);
    there = there & less_equal(u0, splat(1)) & less_equal(splat(-1), u1);
    const auto cell = [&](Floats u)
                          FIRN_INLINE_LAMBDA { return __builtin_convertvector((u + 1) / facets.step, Ints); };
    store(asked.first[face][k] + begin, max(cell(max(u0, splat(-1))), splat_int(0)));
    store(asked.last[face][k] + begin, min(cell(min(u1, splat(1))), splat_int(facets.side - 1)));
  }
  asked.on_face[face] |= static_cast<std::uint64_t>(lane_bits(there)) << begin;
}

// Of `count` points from i on, which stand in the window from `begin` on.
FIRN_INLINE void ask(const FacetCells& facets, const GlintView& view, std::size_t i, int count, int begin,
                     Asked& asked) {
  Three q;
  for (int a = 0; a < 3; ++a) {
    alignas(64) std::int32_t turn[kLanes] = {};
    for (int lane = 0; lane < count; ++lane) turn[lane] = view.turn[a][i + lane];
    q.of[a] = to_float(load(turn)) * (1 / 32767.f);
  }
  const Floats q2 = dot(q, q);
  const Three smooth = load3(view.smooth, i, count, 0.f), eye = load3(view.back, i, count, 1.f),
              light = load3(view.light, i, count, 1.f);
  Three half;
  for (int a = 0; a < 3; ++a) half.of[a] = eye.of[a] + light.of[a];
  const Floats length = sqrt(dot(half, half));
  for (int a = 0; a < 3; ++a) half.of[a] = half.of[a] / length;
  const Mask faces = less(splat(0), dot(smooth, eye)) & less(splat(0), dot(smooth, light));
  const Three at = turn_back(q, q2, load3(view.local, i, count, 0.f)), n = turn_back(q, q2, smooth),
              h = turn_back(q, q2, half);
  const Floats deep = splat(facets.radius);
  const Floats wide = max(min(load_first(view.footprint + i, count, 0.f), splat(facets.widest)), deep);
  for (int a = 0; a < 3; ++a) {
    const Floats n2 = n.of[a] * n.of[a];
    const Floats box = sqrt(fma(wide * wide, max(1 - n2, splat(0)), deep * deep * n2)) * kMargin;
    store(asked.low[a] + begin, floor_to_ints((at.of[a] - box) * facets.inv_cell));
    store(asked.high[a] + begin, floor_to_ints((at.of[a] + box) * facets.inv_cell));
    store(asked.at[a] + begin, at.of[a]), store(asked.normal[a] + begin, n.of[a]);
    store(asked.box[a] + begin, box);
  }
  store(asked.shrunk + begin, square(deep / wide));
  store(asked.id + begin, load_first(reinterpret_cast<const std::int32_t*>(view.id) + i, count, 0));
  const Floats chord = (facets.chord + load_first(view.light_chord + i, count, 0.f)) * kMargin;
  for (int face = 0; face < 6; ++face)
    ask_face(facets, face, h, chord, faces & mask_of_first(count), begin, asked);
}

// Calls visit(place) for the points of a window, by the bits of `points`.
template <class Visit>
FIRN_INLINE void each_of(std::uint64_t points, Visit&& visit) {
  for (; points != 0; points &= points - 1) visit(__builtin_ctzll(points));
}

// The cells for which points of one particle ask.
class SharedCells {
 public:
  SharedCells(const FacetCells& facets, const Asked& asked) : facets_(facets), asked_(asked) {}

  // False if there are too many.
  FIRN_INLINE bool set(std::uint64_t points) {
    points_ = points;
    return set_places() && set_turns();
  }

  // Those of the points that a facet of these cells holds. Most cells have none: those that do wait, so that
  // facets fill the lanes.
  FIRN_INLINE std::uint64_t glinting() {
    std::uint64_t found = 0;
    waiting_ = 0;
    for (int t = 0; t < turns_; t += kHalfLanes) {
      const Longs key = mix64(load_half<Longs>(turn_ + t));
      __builtin_memcpy(turn_ + t, &key, sizeof key);
    }
    const int at_once = places_ < kHalfLanes ? kHalfLanes / places_ : 1;  // directions
    HalfLongs whose = {};
    for (int k = places_; k < at_once * places_; ++k) {
      place_[k] = place_[k - places_];
      for (auto& corner : corner_) corner[k] = corner[k - places_];
      whose[k] = k / places_;
    }
    for (int t = 0; t < turns_; t += at_once) {
      const Longs turn = permute(load_half<Longs>(turn_ + t), whose);
      const int count = (turns_ - t < at_once ? turns_ - t : at_once) * places_;
      for (int k = 0; k < count; k += kHalfLanes) {
        if (waiting_ > kMostWaiting) found |= ask_waiting();
        note_cells(mix64(turn ^ load_half<Longs>(place_ + k)), k, count - k);
      }
    }
    return found | ask_waiting();
  }

 private:
  FIRN_INLINE bool set_places() {
    int low[3], high[3], all = 1;
    for (int a = 0; a < 3; ++a) {
      low[a] = INT32_MAX, high[a] = INT32_MIN;
      from_[a] = __builtin_huge_valf(), to_[a] = -from_[a];
      each_of(points_, [&](int k) FIRN_INLINE_LAMBDA {
        low[a] = asked_.low[a][k] < low[a] ? asked_.low[a][k] : low[a];
        high[a] = asked_.high[a][k] > high[a] ? asked_.high[a][k] : high[a];
        const float from = asked_.at[a][k] - asked_.box[a][k], to = asked_.at[a][k] + asked_.box[a][k];
        from_[a] = from < from_[a] ? from : from_[a];
        to_[a] = to > to_[a] ? to : to_[a];
      });
      all *= high[a] - low[a] + 1;
    }
    if (all > kMostPlaces) return false;
    const auto bits = [](int k) { return static_cast<std::uint64_t>(k & 0x1fffff); };
    places_ = 0;
    for (int x = low[0]; x <= high[0]; ++x) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int z = low[2]; z <= high[2]; ++z) {
          const int corner[3] = {x, y, z};
          for (int a = 0; a < 3; ++a) corner_[a][places_] = static_cast<float>(corner[a]);
          place_[places_++] = bits(x) << 42 | bits(y) << 21 | bits(z);
        }
      }
    }
    return true;
  }

  FIRN_INLINE bool set_turns() {
    turns_ = 0;
    for (int face = 0; face < 6; ++face) {
      const std::uint64_t there = points_ & asked_.on_face[face];
      if (there == 0) continue;
      int first[2], last[2];
      for (int k = 0; k < 2; ++k) {
        first[k] = INT32_MAX, last[k] = INT32_MIN;
        each_of(there, [&](int p) FIRN_INLINE_LAMBDA {
          first[k] = asked_.first[face][k][p] < first[k] ? asked_.first[face][k][p] : first[k];
          last[k] = asked_.last[face][k][p] > last[k] ? asked_.last[face][k][p] : last[k];
        });
      }
      if (turns_ + (last[0] - first[0] + 1) * (last[1] - first[1] + 1) > kMostTurns) return false;
      const auto id = static_cast<std::uint32_t>(asked_.id[__builtin_ctzll(there)]);
      const std::uint64_t key = static_cast<std::uint64_t>(id) << 32 | static_cast<std::uint64_t>(face) << 24;
      for (int i = first[0]; i <= last[0]; ++i) {
        for (int j = first[1]; j <= last[1]; ++j)
          turn_[turns_++] = key | static_cast<std::uint64_t>(i << 12 | j);
      }
    }
    return true;
  }

  // Whether as many facets as `until` is the chance to have fewer than: 53 bits, as uniform_double has them.
  FIRN_INLINE static HalfLongs has_more(Longs bits, double until) {
    return (HalfLongs)(bits >> 11) >= static_cast<std::int64_t>(until * 0x1p53);
  }

  // bits: of `count` cells, whose places begin at k. No branch: which cells wait cannot be foretold, and
  // hashes are long in coming.
  FIRN_INLINE void note_cells(Longs bits, int k, int count) {
    const int some = long_lane_bits(has_more(bits, facets_.none) & (long_lane_numbers() < count));
    std::uint64_t each[kHalfLanes];
    __builtin_memcpy(each, &bits, sizeof each);
    int end = waiting_;
#pragma GCC unroll 8
    for (int lane = 0; lane < kHalfLanes; ++lane) {
      waiting_bits_[end] = each[lane];
      waiting_place_[end] = k + lane;
      end += some >> lane & 1;
    }
    waiting_ = end;
  }

  // The points that facets of the cells that wait hold.
  std::uint64_t ask_waiting() {
    std::uint64_t found = 0;
    for (int k = 0; k < waiting_; k += kHalfLanes) {
      const Longs bits = load_half<Longs>(waiting_bits_ + k);
      HalfLongs open = long_lane_numbers() < waiting_ - k;
      double chance = facets_.none, until = chance;
      for (int n = 1; n < kMostFacets && long_lane_bits(open) != 0; ++n) {
        found |= ask_facets(mix64(bits + static_cast<std::uint64_t>(n)), k, open);
        chance *= facets_.mean / n;
        until += chance;
        open &= has_more(bits, until);
      }
    }
    waiting_ = 0;
    return found;
  }

  // place: bits of a facet each of the cells that wait from k on, in the lanes that are open.
  FIRN_INLINE std::uint64_t ask_facets(Longs place, int k, HalfLongs open) const {
    std::uint64_t found = 0;
    float at[3][kHalfLanes];
    HalfInts near = HalfInts{} == 0;  // to one of the points
    for (int a = 0; a < 3; ++a) {
      HalfFloats corner;
      for (int lane = 0; lane < kHalfLanes; ++lane) corner[lane] = corner_[a][waiting_place_[k + lane]];
      const HalfFloats its = facets_.cell * (corner + bits_to_float(place, 21 * a, 0x1fffff) * 0x1p-21f);
      __builtin_memcpy(at[a], &its, sizeof its);
      near &= (its >= from_[a]) & (its <= to_[a]);
    }
    int facets = long_lane_bits(__builtin_convertvector(near, HalfLongs) & open);
    for (; facets != 0; facets &= facets - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(facets));
      found |= held_by(at[0][lane], at[1][lane], at[2][lane]);
    }
    return found;
  }

  // The points that a facet there holds.
  FIRN_INLINE std::uint64_t held_by(float x, float y, float z) const {
    std::uint64_t found = 0;
    const Floats deep2 = splat(facets_.radius * facets_.radius * kMargin);
    for (int begin = 0; begin < kWindow; begin += kLanes) {
      const auto here = static_cast<int>(points_ >> begin) & kAllLanes;
      if (here == 0) continue;
      const Three off = {
          {x - load(asked_.at[0] + begin), y - load(asked_.at[1] + begin), z - load(asked_.at[2] + begin)}};
      const Three normal = {
          {load(asked_.normal[0] + begin), load(asked_.normal[1] + begin), load(asked_.normal[2] + begin)}};
      const Floats depth = dot(off, normal), depth2 = depth * depth;
      const Mask held = less(fma(dot(off, off) - depth2, load(asked_.shrunk + begin), depth2), deep2);
      found |= static_cast<std::uint64_t>(lane_bits(held) & here) << begin;
    }
    return found;
  }

  const FacetCells& facets_;
  const Asked& asked_;
  std::uint64_t points_ = 0;
  float from_[3] = {}, to_[3] = {};  // m, the box about all that they see
  int places_ = 0, turns_ = 0;
  std::uint64_t place_[kMostPlaces + kHalfLanes] = {}, turn_[kMostTurns + kHalfLanes] = {};
  float corner_[3][kMostPlaces + kHalfLanes] = {};  // cells
  int waiting_ = 0;
  std::uint64_t waiting_bits_[kMostWaiting + 2 * kHalfLanes] = {};
  std::int32_t waiting_place_[kMostWaiting + 2 * kHalfLanes] = {};
};

// Those of the points, of one particle, that may glint.
std::uint64_t glinting(SharedCells& cells, std::uint64_t points) {
  if (cells.set(points)) return cells.glinting();
  const int count = __builtin_popcountll(points);
  if (count == 1) return points;
  std::uint64_t half = points;
  for (int k = 0; k < count / 2; ++k) half &= half - 1;
  return glinting(cells, half) | glinting(cells, points & ~half);
}

// The points of a window that belong to the particle of point k.
FIRN_INLINE std::uint64_t alike(const Asked& asked, int k) {
  std::uint64_t points = 0;
  for (int begin = 0; begin < kWindow; begin += kLanes) {
    const Mask same = equal(load(asked.id + begin), splat_int(asked.id[k]));
    points |= static_cast<std::uint64_t>(lane_bits(same)) << begin;
  }
  return points;
}

}  // namespace

void may_glint(const FacetCells& facets, const GlintView& view, std::size_t begin, std::size_t end,
               std::uint8_t* glints) {
  Asked asked = {};
  SharedCells cells(facets, asked);
  for (std::size_t i = begin; i < end; i += kWindow) {
    const int count = static_cast<int>(end - i < kWindow ? end - i : kWindow);
    for (std::uint64_t& points : asked.on_face) points = 0;
    for (int k = 0; k < count; k += kLanes)
      ask(facets, view, i + static_cast<std::size_t>(k), count - k < kLanes ? count - k : kLanes, k, asked);
    std::uint64_t waiting = 0, found = 0;
    for (const std::uint64_t points : asked.on_face) waiting |= points;
    for (int k = 0; k < count; ++k) {  // of wide lights the mean shines
      if (view.light_chord[i + k] > kWidest * facets.chord) found |= std::uint64_t{1} << k;
    }
    for (waiting &= ~found; waiting != 0;) {
      const std::uint64_t points = waiting & alike(asked, __builtin_ctzll(waiting));
      found |= glinting(cells, points);
      waiting &= ~points;
    }
    for (int k = 0; k < count; ++k) glints[i + k] = static_cast<std::uint8_t>(found >> k & 1);
  }
}

}  // namespace firn::kernels::FIRN_ISA
