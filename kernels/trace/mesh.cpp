// SPDX-License-Identifier: MIT
// A ray against the triangles of a mesh: down a tree of boxes, 16 to a node, nearest first, and 16 triangles
// at once. Floats in lanes only sort out: boxes are padded, and triangles stay wherever rounding leaves a
// doubt. The few that are left are asked in double, from where the ray enters the mesh's bounds. So the
// answer is that of asking all triangles in double, whatever the tree and the instruction set: the nearest,
// of equal distances the one of the lower index; and edges let no ray through.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr int kMostStacked = kMostMeshDepth * kRayLanes;

FIRN_INLINE void cross(const Floats a[3], const Floats b[3], Floats out[3]) {
  for (int k = 0; k < 3; ++k)
    out[k] = fma(a[(k + 1) % 3], b[(k + 2) % 3], -(a[(k + 2) % 3] * b[(k + 1) % 3]));
}
FIRN_INLINE Floats dot(const Floats a[3], const Floats b[3]) {
  return fma(a[2], b[2], fma(a[1], b[1], a[0] * b[0]));
}

// A ray in double whose own axis is the longest of its direction: space is sheared until the ray is that axis
// (Woop et al. 2013, "Watertight ray/triangle intersection").
struct ShearedRay {
  double o[3];      // m
  double shear[2];  // of the other two axes
  double stretch;   // m along the ray per metre of its axis
  int axis, side[2];

  void aim(const double d[3]) {
    const auto size = [&](int a) { return d[a] < 0 ? -d[a] : d[a]; };
    axis = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
    stretch = 1 / d[axis];
    for (int k = 0; k < 2; ++k) {
      side[k] = (axis + k + 1) % 3;
      shear[k] = d[side[k]] * stretch;
    }
  }
};

// A value of each corner, one of two sides of the ray: the least and the greatest, and whose they are.
struct Extent {
  int low = 0, high = 0;

  explicit Extent(const double side[3]) {
    for (int k = 1; k < 3; ++k) {
      if (side[k] < side[low]) low = k;
      if (side[k] > side[high]) high = k;
    }
  }
};

// Where the ray passes the edge between the corners that are farthest apart on this side of it.
double pass_edge(const double side[3], const Extent& extent, const double z[3]) {
  const double width = side[extent.high] - side[extent.low];
  return z[extent.low] - side[extent.low] / width * (z[extent.high] - z[extent.low]);
}

// How far along the ray the triangle is, or a negative distance. The ray passes an edge on the same side of
// both triangles that share it, to the last bit. A computed area has the sign of the true one or none. So of
// a triangle that is seen edge on all three may have none, beside it too, which the extents rule out, and are
// no weights for its distance.
double meet(const MeshView& mesh, std::int32_t triangle, const ShearedRay& ray) {
  const std::int32_t* const corner = mesh.corners + 3 * static_cast<std::size_t>(triangle);
  double x[3], y[3], z[3], area[3];
  for (int k = 0; k < 3; ++k) {
    const double* const p = mesh.vertices + 3 * static_cast<std::size_t>(corner[k]);
    z[k] = p[ray.axis] - ray.o[ray.axis];
    x[k] = (p[ray.side[0]] - ray.o[ray.side[0]]) - ray.shear[0] * z[k];
    y[k] = (p[ray.side[1]] - ray.o[ray.side[1]]) - ray.shear[1] * z[k];
  }
  for (int k = 0; k < 3; ++k) {
    const int b = (k + 1) % 3, c = (k + 2) % 3;
    area[k] = x[b] * y[c] - y[b] * x[c];
  }
  if (!(area[0] >= 0 && area[1] >= 0 && area[2] >= 0) && !(area[0] <= 0 && area[1] <= 0 && area[2] <= 0))
    return -1;
  const double whole = area[0] + area[1] + area[2];
  const Extent of_x(x), of_y(y);
  if (whole == 0 || x[of_x.low] > 0 || x[of_x.high] < 0 || y[of_y.low] > 0 || y[of_y.high] < 0) return -1;
  const double wide = x[of_x.high] - x[of_x.low], high = y[of_y.high] - y[of_y.low];
  if (kMeshEdgeOn * wide * high > (whole < 0 ? -whole : whole))
    return (wide > high ? pass_edge(x, of_x, z) : pass_edge(y, of_y, z)) * ray.stretch;
  return (area[0] * z[0] + area[1] * z[1] + area[2] * z[2]) / whole * ray.stretch;
}

template <bool kAny>
class MeshRay {
 public:
  MeshRay(const MeshView& mesh, const double o[3], const double d[3], double limit)
      : mesh_(mesh), from_(o), along_(d), limit_(limit) {}

  double trace(std::int32_t& triangle) {
    if (mesh_.nodes == nullptr || !enter()) return limit_;
    stack_[count_++] = {0, 0};
    while (count_ > 0) {
      const Place place = stack_[--count_];
      if (place.t > reach_) continue;
      if (place.child >= 0) {
        open(mesh_.nodes[place.child]);
      } else {
        test(mesh_.triangles[~place.child]);
        if (kAny && found_ >= 0) break;
      }
    }
    if (found_ >= 0) triangle = found_;
    return limit_;
  }

 private:
  struct Place {
    float t;
    std::int32_t child;
  };

  bool enter();
  void shorten();
  FIRN_INLINE void open(const BoxBundle& node);
  FIRN_INLINE void test(const TriangleBundle& triangles);
  FIRN_INLINE void confirm(std::int32_t triangle);

  const MeshView& mesh_;
  const double *from_, *along_;
  double limit_;      // m, to what was found
  double entry_ = 0;  // m, to the mesh
  ShearedRay ray_;    // from there
  float reach_ = 0;   // m, from there, with what rounding may add
  Floats o_[3], d_[3], inv_[3];
  std::int32_t found_ = -1;
  int count_ = 0;
  Place stack_[kMostStacked];
};

// To the mesh's bounds; false if the ray does not come there.
template <bool kAny>
bool MeshRay<kAny>::enter() {
  double in = 0, out = limit_;
  for (int a = 0; a < 3; ++a) {
    const double inv = 1 / along_[a], t0 = (mesh_.low[a] - from_[a]) * inv,
                 t1 = (mesh_.high[a] - from_[a]) * inv;
    if (along_[a] == 0) {
      if (from_[a] < mesh_.low[a] || from_[a] > mesh_.high[a]) return false;
      continue;
    }
    const double low = t0 < t1 ? t0 : t1, high = t0 < t1 ? t1 : t0;
    in = low > in ? low : in;
    out = high < out ? high : out;
  }
  if (!(in <= out)) return false;
  entry_ = in;
  for (int a = 0; a < 3; ++a) {
    ray_.o[a] = from_[a] + entry_ * along_[a];
    o_[a] = splat(static_cast<float>(ray_.o[a]));
    d_[a] = splat(static_cast<float>(along_[a]));
    inv_[a] = inverse_of(d_[a]);
  }
  ray_.aim(along_);
  shorten();
  return true;
}

template <bool kAny>
void MeshRay<kAny>::shorten() {
  const double most = 4 * static_cast<double>(mesh_.size), left = limit_ - entry_;
  reach_ = static_cast<float>(left < most ? left : most) + kMeshMargin * mesh_.size;
}

// Puts the children that the ray comes to on the stack, the nearest on top.
template <bool kAny>
FIRN_INLINE void MeshRay<kAny>::open(const BoxBundle& node) {
  float first[kRayLanes];
  const int bottom = count_;
  for (int part = 0; part < node.count; part += kLanes) {
    const int left = node.count - part;
    const Mask there = mask_of_first(left < kLanes ? left : kLanes);
    Floats in = splat(0), out = splat(reach_);
    for (int a = 0; a < 3; ++a) {
      const Floats t0 = (load(node.low[a] + part) - o_[a]) * inv_[a],
                   t1 = (load(node.high[a] + part) - o_[a]) * inv_[a];
      in = max(in, min(t0, t1));
      out = min(out, max(t0, t1));
    }
    store(first + part, in);
    for (int met = lane_bits(less_equal(in, out) & there); met != 0; met &= met - 1) {
      const int k = part + __builtin_ctz(static_cast<unsigned>(met));
      int at = count_++;
      for (; at > bottom && stack_[at - 1].t < first[k]; --at) stack_[at] = stack_[at - 1];
      stack_[at] = {first[k], node.child[k]};
    }
  }
}

// By Cramer's rule (Moeller, Trumbore 1997), with every bound moved by what rounding may do.
template <bool kAny>
FIRN_INLINE void MeshRay<kAny>::test(const TriangleBundle& triangles) {
  const float edge = triangles.longest, e = kMeshMargin * mesh_.size * edge,
              e_det = kMeshMargin * edge * edge;
  for (int part = 0; part < kRayLanes; part += kLanes) {
    Floats s[3], u[3], v[3], p[3], q[3];
    for (int a = 0; a < 3; ++a) {
      s[a] = o_[a] - load(triangles.a[a] + part);
      u[a] = load(triangles.u[a] + part);
      v[a] = load(triangles.v[a] + part);
    }
    cross(d_, v, p);
    cross(s, u, q);
    const Floats det = dot(u, p), size = abs(det);
    const Floats bu = copy_sign(splat(1), det) * dot(s, p), bv = copy_sign(splat(1), det) * dot(d_, q),
                 t = copy_sign(splat(1), det) * dot(v, q);
    const Mask in = less_equal(splat(-e), bu) & less_equal(splat(-e), bv) &
                    less_equal(bu + bv, size + (2 * e + e_det)) & less_equal(splat(-e * edge), t) &
                    less_equal(t, fma(size, splat(reach_), splat(e * edge + e_det * reach_)));
    const Mask flat = less_equal(size, splat(e_det));  // seen along its plane
    int doubtful = lane_bits(in | flat);
    for (; doubtful != 0; doubtful &= doubtful - 1) {
      const std::int32_t triangle = triangles.index[part + __builtin_ctz(static_cast<unsigned>(doubtful))];
      if (triangle >= 0) confirm(triangle);
    }
  }
}

template <bool kAny>
FIRN_INLINE void MeshRay<kAny>::confirm(std::int32_t triangle) {
  const double rest = meet(mesh_, triangle, ray_), t = entry_ + rest;
  if (!(rest > 0) || !(t < limit_ || (t == limit_ && found_ >= 0 && triangle < found_))) return;
  limit_ = t;
  found_ = triangle;
  shorten();
}

}  // namespace

double mesh_closest(const MeshView& mesh, const double o[3], const double d[3], double limit,
                    std::int32_t& triangle) {
  return MeshRay<false>(mesh, o, d, limit).trace(triangle);
}

bool mesh_occluded(const MeshView& mesh, const double o[3], const double d[3], double limit) {
  std::int32_t triangle = -1;
  MeshRay<true>(mesh, o, d, limit).trace(triangle);
  return triangle >= 0;
}

}  // namespace firn::kernels::FIRN_ISA
