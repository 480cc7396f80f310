// SPDX-License-Identifier: MIT
#include "kernels/reference/mesh.h"

#include <cmath>
#include <limits>

namespace firn::kernels::reference {
namespace {

// Corners seen along the ray: x and y beside it, z along its longest axis (Woop et al. 2013).
struct Corner {
  double x, y, z;
};
double area(const Corner& a, const Corner& b) { return a.x * b.y - a.y * b.x; }

const Corner& least(const Corner& a, const Corner& b, double Corner::*side) {
  return b.*side < a.*side ? b : a;
}
const Corner& greatest(const Corner& a, const Corner& b, double Corner::*side) {
  return b.*side > a.*side ? b : a;
}

// z where the ray passes the edge from the least to the greatest of a coordinate.
double on_edge(const Corner& from, const Corner& to, double Corner::*side) {
  return from.z - from.*side / (to.*side - from.*side) * (to.z - from.z);
}

bool meet(const Corner& a, const Corner& b, const Corner& c, double& z) {
  const double of_a = area(b, c), of_b = area(c, a), of_c = area(a, b), whole = of_a + of_b + of_c;
  const Corner &left = least(least(a, b, &Corner::x), c, &Corner::x),
               &right = greatest(greatest(a, b, &Corner::x), c, &Corner::x),
               &bottom = least(least(a, b, &Corner::y), c, &Corner::y),
               &top = greatest(greatest(a, b, &Corner::y), c, &Corner::y);
  const double width = right.x - left.x, height = top.y - bottom.y;
  z = (of_a * a.z + of_b * b.z + of_c * c.z) / whole;
  if (kMeshEdgeOn * width * height > std::fabs(whole))
    z = width > height ? on_edge(left, right, &Corner::x) : on_edge(bottom, top, &Corner::y);
  return whole != 0 && left.x <= 0 && right.x >= 0 && bottom.y <= 0 && top.y >= 0 &&
         ((of_a >= 0 && of_b >= 0 && of_c >= 0) || (of_a <= 0 && of_b <= 0 && of_c <= 0));
}

// m, to the mesh's bounds; infinite where the ray does not come there.
double entry_of(const MeshView& mesh, const double o[3], const double d[3], double limit) {
  double in = 0, out = limit;
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0 && o[a] >= mesh.low[a] && o[a] <= mesh.high[a]) continue;
    const double inv = 1 / d[a], low = (mesh.low[a] - o[a]) * inv, high = (mesh.high[a] - o[a]) * inv;
    in = std::fmax(in, std::fmin(low, high));
    out = d[a] == 0 ? -1 : std::fmin(out, std::fmax(low, high));
  }
  return in <= out ? in : std::numeric_limits<double>::infinity();
}

}  // namespace

double mesh_closest(const MeshView& mesh, std::size_t count, const double o[3], const double d[3],
                    double limit, std::int32_t& triangle) {
  const double entry = entry_of(mesh, o, d, limit);
  if (std::isinf(entry)) return limit;
  int axis = 2;
  if (std::fabs(d[1]) > std::fabs(d[2])) axis = 1;
  if (std::fabs(d[0]) > std::fabs(d[1]) && std::fabs(d[0]) > std::fabs(d[2])) axis = 0;
  const int right = (axis + 1) % 3, up = (axis + 2) % 3;
  const double stretch = 1 / d[axis];
  const auto corner = [&](std::size_t k) {
    const double* const p = mesh.vertices + 3 * mesh.corners[k];
    const auto from_entry = [&](int a) { return p[a] - (o[a] + entry * d[a]); };
    const double z = from_entry(axis);
    return Corner{from_entry(right) - d[right] * stretch * z, from_entry(up) - d[up] * stretch * z, z};
  };
  for (std::size_t i = 0; i < count; ++i) {
    double z = 0;
    if (!meet(corner(3 * i), corner(3 * i + 1), corner(3 * i + 2), z)) continue;
    const double t = z * stretch;
    if (t > 0 && entry + t < limit) limit = entry + t, triangle = static_cast<std::int32_t>(i);
  }
  return limit;
}

}  // namespace firn::kernels::reference
