// SPDX-License-Identifier: MIT
// Height rasters: the two file formats, bilinear heights and slopes, volume, and the sign of the distance.
#include "src/geometry/height_field.h"

#include <cmath>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/geometry/shape.h"
#include "tests/catch.h"
#include "tests/scene/refuses.h"
#include "tests/scene/temporary_folder.h"

namespace firn::test::height_field {
namespace {

HeightRaster plane_raster() {  // h = 1 + 0.5 x - 0.25 z over 4 m x 2 m
  std::vector<double> heights;
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 9; ++column)
      heights.push_back(1 + 0.5 * (column * 0.5 - 2) - 0.25 * (row * 0.5 - 1));
  }
  return HeightRaster(9, 5, heights, 4, 2);
}

}  // namespace

TEST_CASE("a raster of a tilted plane gives its heights and slopes everywhere") {
  const HeightRaster raster = plane_raster();
  for (int i = 0; i < 100; ++i) {
    const double x = 4 * uniform_double(hash_keys(1, i)) - 2, z = 2 * uniform_double(hash_keys(2, i)) - 1;
    const HeightSample sample = raster.sample(x, z);
    CHECK(sample.height == Approx(1 + 0.5 * x - 0.25 * z));
    CHECK(sample.slope_x == Approx(0.5));
    CHECK(sample.slope_z == Approx(-0.25));
  }
  CHECK(raster.sample(-9, 0).height == Approx(0));
  CHECK(raster.volume_above(-1) == Approx(16));
  CHECK(raster.volume_above(0) == Approx(8).epsilon(0.01));
}

TEST_CASE("a height field is solid exactly between its base and its surface") {
  const Shape shape{HeightField{std::make_shared<HeightRaster>(plane_raster()), -0.5}, {}};
  for (int i = 0; i < 2000; ++i) {
    const auto axis = [&](int k, double half) { return half * (2 * uniform_double(hash_keys(3, i, k)) - 1); };
    const Vec3 p(axis(0, 3), axis(1, 3), axis(2, 2));
    const bool solid =
        std::abs(p.x()) < 2 && std::abs(p.z()) < 1 && p.y() > -0.5 && p.y() < 1 + 0.5 * p.x() - 0.25 * p.z();
    CHECK((signed_distance(shape, p) < 0) == solid);
  }
  const SurfaceDistance above = closest_surface(shape, Vec3(0, 1.1, 0));
  CHECK(above.distance == Approx(0.1 / std::sqrt(1 + 0.25 + 0.0625)));
  CHECK(above.normal.y() == Approx(1 / std::sqrt(1 + 0.25 + 0.0625)));
}

TEST_CASE("text, 8-bit and 16-bit PGM files give the same raster") {
  const test::TemporaryFolder folder;
  const Vec3 extent(2, 3, 1);
  const std::string text = folder.write("a.pgm", "P2\n# a comment\n3 2\n255\n0 51 102\n153 204 255\n");
  const std::string narrow =
      folder.write("b.pgm", std::string("P5 3 2 255\n") + std::string("\0\x33\x66\x99\xcc\xff", 6));
  const std::string wide =
      folder.write("c.pgm", std::string("P5 3 2 65535\n") +
                                std::string("\0\0\x33\x33\x66\x66\x99\x99\xcc\xcc\xff\xff", 12));
  for (const std::string& path : {text, narrow, wide}) {
    const HeightRaster raster = load_height_raster(path, extent);
    CHECK(raster.columns() == 3);
    CHECK(raster.rows() == 2);
    CHECK(raster.node(0, 0) == Approx(0));
    CHECK(raster.node(1, 0) == Approx(0.6));
    CHECK(raster.node(2, 1) == Approx(3));
    CHECK(raster.sample(-1, 0.5).height == Approx(1.8));
  }
}

TEST_CASE("an ESRI ASCII grid is metres as it stands, or stretched into an extent") {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("dem.asc",
                                        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize "
                                        "10\nNODATA_value -9999\n100 110 120\n130 140 150\n");
  const HeightRaster metres = load_height_raster(path, std::nullopt);
  CHECK(metres.width() == 20);
  CHECK(metres.depth() == 10);
  CHECK(metres.lowest() == 100);
  CHECK(metres.highest() == 150);
  const HeightRaster stretched = load_height_raster(path, Vec3(2, 1, 1));
  CHECK(stretched.width() == 2);
  CHECK(stretched.node(1, 0) == Approx(0.2));
}

TEST_CASE("damaged height files are refused with their name and the reason") {
  const test::TemporaryFolder folder;
  const Vec3 extent(1, 1, 1);
  CHECK_REFUSES(load_height_raster(folder.path("no.pgm"), extent), "no.pgm: no such height field");
  CHECK_REFUSES(load_height_raster(folder.write("short.pgm", "P2 3 2 255 0 1 2"), extent),
                "ends before its last pixel");
  CHECK_REFUSES(load_height_raster(folder.write("a.pgm", "P2 3 2 255 0 1 2 3 4 5"), std::nullopt),
                "needs `extent`");
  CHECK_REFUSES(load_height_raster(folder.write("x.asc", "hello 3\n1 2 3"), std::nullopt), "no 'ncols'");
  CHECK_REFUSES(
      load_height_raster(folder.write("h.asc", "ncols 2\nnrows 2\ncellsize 1\nnodata_value -1\n1 2 3 -1"),
                         std::nullopt),
      "has holes");
}

}  // namespace firn::test::height_field
