// SPDX-License-Identifier: MIT
// Which points of the snow may glint: one in some hundred does, so what is asked of all is only whether a
// facet lies there that is turned about right; src/render/sparkle.h has the light. A register of points is
// turned into their particles' frames and told which cells of place and direction to ask; then the cells, one
// after another whosever they are, are hashed for whether they hold facets; then the few that do are asked
// where. Bounds are a little wider than the facets' own, for rounding.
#include "kernels/shade/table.h"
#include "kernels/simd/hash.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr int kMostCells = 64;     // of a point; with more it may glint
constexpr float kMargin = 1.001f;  // of lengths
constexpr float kWidest = 4;       // light cones, in cones of a facet, beyond which their mean shines

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

// What the points of a register ask of the facets.
struct Asked {
  alignas(64) std::int32_t low[3][kLanes], high[3][kLanes];          // cells of place
  alignas(64) std::int32_t first[6][2][kLanes], last[6][2][kLanes];  // of direction, for each face of a cube
  int on_face[6];                                                    // lanes that ask there
  alignas(64) float at[3][kLanes], normal[3][kLanes];                // in the particle's frame
  alignas(64) float shrunk[kLanes];
};

// As FacetField::cells_of_face.
FIRN_INLINE void ask_face(const FacetCells& facets, int face, const Three& half, Floats chord, Mask lanes,
                          Asked& asked) {
  const int axis = face >> 1;
  const Floats along = face & 1 ? -half.of[axis] : half.of[axis];
  const Floats most = along + chord, least = max(along - chord, splat(0.577f));
  Mask there = lanes & less_equal(least, most);
  asked.on_face[face] = 0;
  if (!any(there)) return;
  for (int k = 0; k < 2; ++k) {
    const Floats across = half.of[(axis + 1 + k) % 3], low = across - chord, high = across + chord;
    const Floats u0 = low / select(less(low, splat(0)), least, most);
    const Floats u1 = high / select(less(high, splat(0)), most, least);
    there = there & less_equal(u0, splat(1)) & less_equal(splat(-1), u1);
    const auto cell = [&](Floats u)
                          FIRN_INLINE_LAMBDA { return __builtin_convertvector((u + 1) / facets.step, Ints); };
    store(asked.first[face][k], max(cell(max(u0, splat(-1))), splat_int(0)));
    store(asked.last[face][k], min(cell(min(u1, splat(1))), splat_int(facets.side - 1)));
  }
  asked.on_face[face] = lane_bits(there);
}

FIRN_INLINE void ask(const FacetCells& facets, const GlintView& view, std::size_t i, int count,
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
  const Floats wide =
      max(min(load_first(view.footprint + i, count, 0.f), splat(facets.widest)), deep);
  for (int a = 0; a < 3; ++a) {
    const Floats n2 = n.of[a] * n.of[a];
    const Floats box =
        sqrt(fma(wide * wide, max(1 - n2, splat(0)), deep * deep * n2)) * kMargin;
    store(asked.low[a], floor_to_ints((at.of[a] - box) * facets.inv_cell));
    store(asked.high[a], floor_to_ints((at.of[a] + box) * facets.inv_cell));
    store(asked.at[a], at.of[a]), store(asked.normal[a], n.of[a]);
  }
  store(asked.shrunk, square(deep / wide));
  const Floats chord = (facets.chord + load_first(view.light_chord + i, count, 0.f)) * kMargin;
  for (int face = 0; face < 6; ++face) ask_face(facets, face, h, chord, faces & mask_of_first(count), asked);
}

// Cells to be hashed, and whose they are.
class Cells {
 public:
  // Those that a point asks on a face; false if there are too many.
  FIRN_INLINE bool add(const Asked& asked, std::uint32_t id, int lane, int face) {
    int low[3], high[3], all = 1;
    for (int a = 0; a < 3; ++a) {
      low[a] = asked.low[a][lane], high[a] = asked.high[a][lane];
      all *= high[a] - low[a] + 1;
    }
    const int i0 = asked.first[face][0][lane], i1 = asked.last[face][0][lane];
    const int j0 = asked.first[face][1][lane], j1 = asked.last[face][1][lane];
    if (i1 < i0 || j1 < j0) return true;
    if (all * (i1 - i0 + 1) * (j1 - j0 + 1) > kMostCells) return false;
    const auto bits = [](int k) { return static_cast<std::uint64_t>(k & 0x1fffff); };
    for (int i = i0; i <= i1; ++i) {
      for (int j = j0; j <= j1; ++j) {
        const std::uint64_t key =
            static_cast<std::uint64_t>(id) << 32 | static_cast<std::uint64_t>(face) << 24 | i << 12 | j;
        for (int x = low[0]; x <= high[0]; ++x) {
          for (int y = low[1]; y <= high[1]; ++y) {
            for (int z = low[2]; z <= high[2]; ++z) {
              key_[count_] = key;
              place_[count_] = bits(x) << 42 | bits(y) << 21 | bits(z);
              cell_[count_++] = {x, y, z, lane};
            }
          }
        }
      }
    }
    return true;
  }

  // Calls visit(bits, cell) for each facet of the cells: its random bits and the cell (x, y, z, lane).
  template <class Visit>
  FIRN_INLINE void each_facet(const FacetCells& facets, Visit&& visit) {
    // 53 bits, as uniform_double has them.
    const auto limit = [](double chance) { return static_cast<std::int64_t>(chance * 0x1p53); };
    const std::int64_t none = limit(facets.none);
    for (int k = count_; k < count_ + kHalfLanes; ++k) key_[k] = place_[k] = 0;
    int some = 0;
    for (int k = 0; k < count_; k += kHalfLanes) {
      const Longs bits = mix64(mix64(load_half<Longs>(key_ + k)) ^ load_half<Longs>(place_ + k));
      __builtin_memcpy(key_ + k, &bits, sizeof bits);
      std::int64_t drawn[kHalfLanes];
      const Longs high = bits >> 11;
      __builtin_memcpy(drawn, &high, sizeof high);
      for (int l = 0; l < kHalfLanes; ++l) {
        some_[some] = k + l;
        some += drawn[l] >= none && k + l < count_;
      }
    }
    for (int s = 0; s < some; ++s) {
      const int k = some_[s];
      const auto drawn = static_cast<std::int64_t>(key_[k] >> 11);
      double chance = facets.none, until = chance;
      for (int n = 1; n < 256 && drawn >= limit(until); ++n) {
        chance *= facets.mean / n;
        until += chance;
        visit(mix(key_[k] + static_cast<std::uint64_t>(n)), cell_[k]);
      }
    }
    count_ = 0;
  }

  struct Cell {
    int x, y, z, lane;
  };

 private:
  FIRN_INLINE static std::uint64_t mix(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  static constexpr int kRoom = 6 * kMostCells * kLanes;
  int count_ = 0;
  std::uint64_t key_[kRoom + kHalfLanes], place_[kRoom + kHalfLanes];
  Cell cell_[kRoom];
  int some_[kRoom + 1];
};

}  // namespace

void may_glint(const FacetCells& facets, const GlintView& view, std::size_t begin, std::size_t end,
               std::uint8_t* glints) {
  Asked asked;
  Cells cells;
  const float deep2 = facets.radius * facets.radius * kMargin;
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    ask(facets, view, i, count, asked);
    for (int lane = 0; lane < count; ++lane) glints[i + lane] = view.light_chord[i + lane] > kWidest * facets.chord;
    for (int face = 0; face < 6; ++face) {
      for (int left = asked.on_face[face]; left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(static_cast<unsigned>(left));
        if (!cells.add(asked, view.id[i + lane], lane, face)) glints[i + lane] = 1;
      }
    }
    cells.each_facet(facets, [&](std::uint64_t bits, const Cells::Cell& cell) FIRN_INLINE_LAMBDA {
      const auto part = [bits](int shift) { return static_cast<float>(bits >> shift & 0x1fffff) * 0x1p-21f; };
      const float corner[3] = {static_cast<float>(cell.x), static_cast<float>(cell.y),
                               static_cast<float>(cell.z)};
      float off2 = 0, depth = 0;
      for (int a = 0; a < 3; ++a) {
        const float off = facets.cell * (corner[a] + part(21 * a)) - asked.at[a][cell.lane];
        off2 += off * off;
        depth += off * asked.normal[a][cell.lane];
      }
      const float aside2 = off2 - depth * depth;
      if (aside2 * asked.shrunk[cell.lane] + depth * depth < deep2) glints[i + cell.lane] = 1;
    });
  }
}

}  // namespace firn::kernels::FIRN_ISA
