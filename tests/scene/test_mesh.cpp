// SPDX-License-Identifier: MIT
// Triangle meshes: closedness, signed distance against the generalised winding number and a search over all
// triangles.
#include "src/geometry/mesh.h"

#include <Eigen/Geometry>
#include <cmath>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/geometry/shape.h"
#include "tests/catch.h"
#include "tests/scene/refuses.h"
#include "tests/scene/temporary_folder.h"

namespace firn::test::mesh {
namespace {

const std::vector<Vec3> kCubeCorners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                        {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
const std::vector<Triangle> kCubeFaces = {{0, 3, 2}, {0, 2, 1}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                          {2, 3, 7}, {2, 7, 6}, {1, 2, 6}, {1, 6, 5}, {0, 4, 7}, {0, 7, 3}};

const char* kCubeObj =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";

// A bumpy torus: no convexity to lean on.
TriangleMesh bumpy_torus(int rings, int sides) {
  std::vector<Vec3> vertices;
  std::vector<Triangle> faces;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sides; ++j) {
      const double a = 2 * M_PI * i / rings, b = 2 * M_PI * j / sides,
                   r = 0.3 + 0.06 * std::sin(5 * a + 2 * b);
      vertices.emplace_back((1 + r * std::cos(b)) * std::cos(a), r * std::sin(b),
                            (1 + r * std::cos(b)) * std::sin(a));
      const auto at = [&](int u, int v) { return (i + u) % rings * sides + (j + v) % sides; };
      faces.push_back({at(0, 0), at(0, 1), at(1, 1)});
      faces.push_back({at(0, 0), at(1, 1), at(1, 0)});
    }
  }
  return TriangleMesh(vertices, faces);
}

// Van Oosterom, Strackee 1983: the solid angle of every triangle; 1 inside, 0 outside.
double winding_number(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles()) {
    const Vec3 a = mesh.vertices()[t[0]] - p, b = mesh.vertices()[t[1]] - p, c = mesh.vertices()[t[2]] - p;
    const double down =
        a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), down);
  }
  return sum / (4 * M_PI);
}

// The distance to a triangle by dense sampling of its barycentric plane: an upper bound that is nearly tight.
double sampled_distance(const TriangleMesh& mesh, const Vec3& p) {
  double best = 1e300;
  const int parts = 24;
  for (const Triangle& t : mesh.triangles()) {
    const Vec3 &a = mesh.vertices()[t[0]], &b = mesh.vertices()[t[1]], &c = mesh.vertices()[t[2]];
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j) {
        best = std::min(best, (a + (b - a) * i / parts + (c - a) * j / parts - p).norm());
      }
    }
  }
  return best;
}

Vec3 random_point(int key, double half) {
  const auto axis = [&](int k) { return half * (2 * uniform_double(hash_keys(77, key, k)) - 1); };
  return {axis(0), axis(1), axis(2)};
}

}  // namespace

TEST_CASE("a mesh of a unit cube has volume 1 and the distances of a box") {
  const TriangleMesh cube(kCubeCorners, kCubeFaces);
  CHECK(cube.volume() == Approx(1));
  const Shape mesh{Mesh{std::make_shared<TriangleMesh>(cube)}, {}};
  Shape box{Box{Vec3::Constant(0.5)}, {}};
  box.pose.translation = Vec3::Constant(0.5);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = random_point(i, 2.0);
    CHECK(signed_distance(mesh, p) == Approx(signed_distance(box, p)).margin(1e-12));
  }
}

TEST_CASE("a mesh that is inside out is turned") {
  std::vector<Triangle> turned = kCubeFaces;
  for (Triangle& t : turned) std::swap(t[0], t[1]);
  const TriangleMesh cube(kCubeCorners, turned);
  CHECK(cube.volume() == Approx(1));
  CHECK(cube.closest(Vec3(0.5, 0.5, 0.9)).signed_distance == Approx(-0.1));
}

TEST_CASE(
    "the sign of the distance agrees with the winding number and its size with a search of all triangles") {
  const TriangleMesh torus = bumpy_torus(24, 12);
  for (int i = 0; i < 400; ++i) {
    const Vec3 p = random_point(i, 1.5);
    const TriangleMesh::Closest closest = torus.closest(p);
    CHECK((closest.signed_distance < 0) == (winding_number(torus, p) > 0.5));
    const double sampled = sampled_distance(torus, p);
    CHECK(std::abs(closest.signed_distance) <= sampled + 1e-12);
    CHECK(std::abs(closest.signed_distance) > sampled - 0.02);
  }
}

TEST_CASE("a mesh with a missing or a flipped triangle is refused as not closed") {
  std::vector<Triangle> open = kCubeFaces;
  open.pop_back();
  CHECK_REFUSES(TriangleMesh(kCubeCorners, open), "not closed");
  std::vector<Triangle> flipped = kCubeFaces;
  std::swap(flipped[0][0], flipped[0][1]);
  CHECK_REFUSES(TriangleMesh(kCubeCorners, flipped), "not closed");
  CHECK_REFUSES(TriangleMesh(kCubeCorners, {{0, 1, 9}}), "vertex 10 of 8");
  CHECK_REFUSES(TriangleMesh({}, {}), "no triangles");
}

TEST_CASE("an OBJ file of polygons is read, scaled, and its errors name the file") {
  const test::TemporaryFolder folder;
  const TriangleMesh cube = load_obj(folder.write("cube.obj", kCubeObj), 2.0);
  CHECK(cube.triangles().size() == 12);
  CHECK(cube.volume() == Approx(8));
  CHECK_REFUSES(load_obj(folder.path("none.obj"), 1), "none.obj: no such mesh file");
  CHECK_REFUSES(load_obj(folder.write("points.obj", "v 0 0 0\n"), 1), "points.obj: holds no faces");
  CHECK_REFUSES(load_obj(folder.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), 1),
                "one.obj: the mesh is not closed");
  CHECK(test::refusal([&] { load_obj(folder.path("none.obj"), 1); }).code == ErrorCode::io);
}

TEST_CASE("a line of an OBJ file that cannot be read is refused at its place, and never read as zeros") {
  test::TemporaryFolder folder;
  const std::string corners = "v 0 0 0\r\nv 1 0 0 # x\n\tv 0 1 0 0.5 0.5 0.5\nv +0 -0 1.e0\n",
                    faces = "f 1 3 2\nf 1/1 2/1 4/1\nf 2//1 3//1 4//1\nf 3/1/1 -4/1/1 4/1/1\n";
  CHECK(load_obj(folder.write("whole.obj", corners + faces), 1).triangles().size() == 4);
  for (const auto& [line, place] : {std::pair{"v 1 two 3", "5:5"},
                                    {"v 1 2", "5:1"},
                                    {"v 1,0 2 3", "5:3"},
                                    {"v 1 2 3x", "5:7"},
                                    {"f 1 2", "5:1"},
                                    {"f 1 2 4294967299", "5:7"},
                                    {"f 1 2 -99999999999", "5:7"},
                                    {"f 1 2 3.5", "5:7"},
                                    {"f a b c", "5:3"},
                                    {"f 1/ 2 3", "5:3"},
                                    {"f 1/2/ 2 3", "5:3"},
                                    {"  f 1/2/3/4 2 3", "5:5"},
                                    {"f 1 2 x", "5:7"}}) {
    // clang 14 takes no structured binding into a lambda.
    const std::string broken = corners + line + "\n" + faces,
                      expected = std::string("broken.obj:") + place + ": ";
    CHECK_REFUSES(load_obj(folder.write("broken.obj", broken), 1), expected);
  }
}

TEST_CASE("positions that an OBJ repeats for its seams are one vertex") {
  std::vector<Vec3> repeated;
  std::vector<Triangle> faces;
  for (const Triangle& t : kCubeFaces) {
    const int first = static_cast<int>(repeated.size());
    for (int v : t) repeated.push_back(kCubeCorners[v]);
    faces.push_back({first, first + 1, first + 2});
  }
  CHECK(TriangleMesh(repeated, faces).vertices().size() == 8);
}

}  // namespace firn::test::mesh
