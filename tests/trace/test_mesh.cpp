// SPDX-License-Identifier: MIT
// Rays against meshes: the tree of boxes and triangles in lanes answers, to the last bit, what all triangles
// asked in double answer.
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/reference/mesh.h"
#include "src/core/rng.h"
#include "src/render/solids/triangles.h"
#include "tests/catch.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::mesh {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

double uniform(std::uint64_t i, std::uint64_t which) { return 2 * uniform_double(hash_keys(i, which)) - 1; }
Vec3 in_cube(std::uint64_t i, std::uint64_t which) {
  return {uniform(i, which), uniform(i, which + 1), uniform(i, which + 2)};
}

struct Triangles {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  void add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const int first = static_cast<int>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

// Some of any size, some slivers, some of no area, some twice.
Triangles soup(int count, double size, const Vec3& middle) {
  Triangles all;
  for (int i = 0; i < count; ++i) {
    const auto key = static_cast<std::uint64_t>(i);
    const Vec3 a = middle + in_cube(key, 1);
    const double its = size * std::pow(10., uniform(key, 4));
    const Vec3 b = a + its * in_cube(key, 5);
    const Vec3 c = i % 7 == 1   ? Vec3(a + 0.5 * (b - a) + 1e-6 * its * in_cube(key, 8))
                   : i % 7 == 2 ? b
                                : Vec3(a + its * in_cube(key, 8));
    all.add(a, b, c);
    if (i % 11 == 0) all.add(a, b, c);
  }
  return all;
}

// Waves over a square, whose triangles share their corners.
Triangles waves(int across) {
  Triangles all;
  for (int i = 0; i <= across; ++i) {
    for (int k = 0; k <= across; ++k) {
      const double x = 2. * i / across - 1, z = 2. * k / across - 1;
      all.vertices.push_back(Vec3(x, 0.1 * std::sin(7 * x) * std::cos(5 * z), z));
    }
  }
  for (int i = 0; i < across; ++i) {
    for (int k = 0; k < across; ++k) {
      const int first = i * (across + 1) + k;
      all.triangles.push_back({first, first + 1, first + across + 1});
      all.triangles.push_back({first + 1, first + across + 2, first + across + 1});
    }
  }
  return all;
}

// Each a tenth larger and farther than the last, from 1e-8 to 1: cuts by area are most uneven.
Triangles spiral(int count) {
  Triangles all;
  for (int i = 0; i < count; ++i) {
    const Vec3 a = std::pow(1.1, i - count) * Vec3(1, 0.3, -0.2);
    all.add(a, 1.2 * a, 1.1 * a + 0.2 * a.norm() * Vec3(0, 1, 1));
  }
  return all;
}

struct Ray {
  Vec3 o, d;
  double limit;
};

// Through, along, past and from triangles, from near and far.
Ray ray_at(const Triangles& mesh, std::uint64_t i) {
  const Triangle& t = mesh.triangles[hash_keys(i, 31) % mesh.triangles.size()];
  const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
  const double u = uniform_double(hash_keys(i, 32)), v = uniform_double(hash_keys(i, 33));
  Vec3 at = a + u * (1 - v) * (b - a) + v * (c - a), d = in_cube(i, 34).normalized();
  if (i % 5 == 1) at = b;                       // through a corner
  if (i % 5 == 2) at = a + u * (b - a);         // through an edge
  if (i % 5 == 3) at += 0.05 * in_cube(i, 38);  // past it, perhaps
  if (i % 4 == 1) d = Vec3::Unit(static_cast<Eigen::Index>(i / 4 % 3)) * (i % 8 == 1 ? 1 : -1);
  if (i % 16 == 2 && (at - a).norm() > 0) d = (at - a).normalized();  // in its plane
  const double away[] = {0, 1e-3, 3, 1e4};
  const Vec3 o = at - away[i / 5 % 4] * d;
  return {o.cast<float>().cast<double>(), d.cast<float>().cast<double>(), i % 9 == 4 ? 2. : kInf};
}

void check(const Triangles& mesh, std::uint64_t rays) {
  const TriangleSet set(mesh.vertices, mesh.triangles);
  std::size_t hits = 0, wrong = 0;
  for (std::uint64_t i = 0; i < rays; ++i) {
    const Ray ray = ray_at(mesh, i);
    std::int32_t expected = -1;
    const double t = kernels::reference::mesh_closest(set.view(), mesh.triangles.size(), ray.o.data(),
                                                      ray.d.data(), ray.limit, expected);
    hits += expected >= 0;
    for (const auto* table : supported_kernels()) {
      std::int32_t met = -1;
      const double its = table->trace.mesh_closest(set.view(), ray.o.data(), ray.d.data(), ray.limit, met);
      const bool blocked = table->trace.mesh_occluded(set.view(), ray.o.data(), ray.d.data(), ray.limit);
      wrong += its != t || met != expected || blocked != (expected >= 0);
      if (wrong == 1) {
        INFO(table->isa << ", ray " << i << ": " << met << " at " << its << ", not " << expected << " at "
                        << t);
        REQUIRE(wrong == 0);
      }
    }
  }
  CHECK(hits > rays / 10);
}

}  // namespace

TEST_CASE("a mesh answers a ray as all its triangles do in double, to the last bit") {
  for (const int count : {1, 2, 15, 16, 17, 40, 300, 3000}) {
    INFO(count << " triangles");
    check(soup(count, 0.2, Vec3::Zero()), 2000);
    check(soup(count, 0.02, Vec3(300, -20, 4)), 2000);  // far from the middle of its frame
  }
  check(waves(40), 4000);
  check(spiral(200), 2000);
}

TEST_CASE("a triangle seen edge on is met where the ray passes it, and not by rays beside it in its plane") {
  // In the last bits of these numbers all areas are 0 or more, though the ray passes the corner's height 0.19
  // m beside it.
  const std::vector<Vec3> corners = {{0x1.ddb41c555faf1p-2, 0x1.1e9f44333969p-3, -0x1.7e29b0444c8c1p-4},
                                     {0x1.1e9f44333969p-1, 0x1.57f251d711b13p-3, -0x1.ca986d1ec241bp-4},
                                     {0x1.06bca92ef4a05p-1, 0x1.03340e4eb826ep-2, -0x1.c44d701e3cb8p-9}};
  const Vec3 beside(-0x1.5cdba8p+0, -0x1.198b2p+1, -0x1.84a86cp+0),
      d(0x1.d124f8p-2, 0x1.77642ep-1, 0x1.031afp-1);
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  std::size_t edge_on = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    Triangles mesh;
    const double turn = uniform(i, 50);
    const auto moved = [&](const Vec3& p) { return Vec3(p + (i == 0 ? 0 : 1e-3 * turn) * normal); };
    for (const Vec3& corner : corners) mesh.vertices.push_back(moved(corner));
    mesh.triangles = {{0, 1, 2}};
    // Other triangles, so that the ray enters the mesh elsewhere each time.
    mesh.add(Vec3(-1 - 0.1 * uniform(i, 51), -1, -1), Vec3(-1, -1.1, -1), Vec3(-1, -1, -1.1));
    const TriangleSet set(mesh.vertices, mesh.triangles);
    const double across = i % 2 == 0 ? 0 : 1;  // from beside the triangle to it
    const Vec3 middle = (mesh.vertices[0] + mesh.vertices[1] + mesh.vertices[2]) / 3;
    const Vec3 o = (1 - across) * moved(beside) + across * Vec3(middle - 3 * d);
    std::int32_t expected = -1;
    const double t = kernels::reference::mesh_closest(set.view(), 1, o.data(), d.data(), kInf, expected);
    if (expected >= 0) {
      ++edge_on;
      REQUIRE(across == 1);
      const Vec3 met = o + t * d;
      REQUIRE((met - middle).norm() < 0.2);  // within the triangle
    }
    for (const auto* table : supported_kernels()) {
      std::int32_t found = -1;
      REQUIRE(table->trace.mesh_closest(set.view(), o.data(), d.data(), kInf, found) == t);
      REQUIRE(found == expected);
    }
  }
  CHECK(edge_on > 100);
}

TEST_CASE("triangles that all lie in one place make a tree") {
  Triangles mesh;
  for (int i = 0; i < 1000; ++i) mesh.add(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0));
  check(mesh, 500);
}

TEST_CASE("a mesh of no triangles is never met") {
  const TriangleSet none({}, {});
  const Vec3 o(0, 0, 0), d(0, 0, 1);
  for (const auto* table : supported_kernels()) {
    std::int32_t met = -1;
    CHECK(table->trace.mesh_closest(none.view(), o.data(), d.data(), 5, met) == 5);
    CHECK(met == -1);
    CHECK_FALSE(table->trace.mesh_occluded(none.view(), o.data(), d.data(), 5));
  }
}

TEST_CASE("no ray from within a closed mesh leaves it unseen") {
  // An octahedron cut again and again and blown up to bumps.
  Triangles mesh;
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  for (const double sx : {-1., 1.}) {
    for (const double sy : {-1., 1.}) {
      for (const double sz : {-1., 1.}) mesh.add(sx * x, sy * y, sz * z);
    }
  }
  const auto bump = [](const Vec3& p) -> Vec3 {
    const Vec3 n = p.normalized();
    return n * (1 + 0.05 * std::sin(9 * n.x()) * std::sin(8 * n.y()) * std::cos(7 * n.z()));
  };
  for (int round = 0; round < 4; ++round) {
    Triangles finer;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
      const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
      finer.add(a, ab, ca), finer.add(ab, b, bc), finer.add(ca, bc, c), finer.add(ab, bc, ca);
    }
    mesh = finer;
  }
  for (Vec3& p : mesh.vertices) p = bump(p);
  const TriangleSet set(mesh.vertices, mesh.triangles);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const Vec3 o = 0.5 * in_cube(i, 1);
    const Vec3 at = i % 2 == 0 ? mesh.vertices[i % mesh.vertices.size()] : Vec3(o + in_cube(i, 5));
    const Vec3 d = (at - o).normalized();
    REQUIRE(best_trace().mesh_occluded(set.view(), o.data(), d.data(), 10));
  }
}

}  // namespace firn::test::mesh
