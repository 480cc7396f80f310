// SPDX-License-Identifier: MIT
// Points of NumPy, PLY and particle files: every type and order of bytes gives the same points, and what is
// damaged, empty or lies about its size is refused.
#include "src/io/particle_file.h"
#include "src/io/point_file.h"
#include "tests/catch.h"
#include "tests/scene/point_files.h"
#include "tests/scene/refuses.h"

namespace firn::test::point_files {
namespace {

const std::vector<double> kValues = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};  // 4 points

template <class T>
std::vector<T> values_as() {
  return {kValues.begin(), kValues.end()};
}

PointCloud read(const std::string& bytes) { return decode_points(bytes, "file"); }

bool counts_up(const PointCloud& cloud) {
  if (cloud.size() != 4) return false;
  for (int i = 0; i < 4; ++i) {
    if (cloud.position[i] != Vec3(3 * i, 3 * i + 1, 3 * i + 2)) return false;
  }
  return true;
}

const std::string kPlaces = npy("<f8", "(4, 3)", raw(kValues));

std::string ply(const std::string& form, const std::string& head, const std::string& body) {
  return "ply\nformat " + form + " 1.0\n" + head + "end_header\n" + body;
}
const std::string kXyz = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

}  // namespace

TEST_CASE("An array of points is the same in every type, order of bytes and order of axes") {
  CHECK(counts_up(read(kPlaces)));
  CHECK(counts_up(read(npy(">f8", "(4, 3)", raw(kValues, true)))));
  CHECK(counts_up(read(npy("<f4", "(4, 3)", raw(values_as<float>())))));
  CHECK(counts_up(read(npy(">f4", "(4, 3)", raw(values_as<float>(), true)))));
  CHECK(counts_up(read(npy("|i1", "(4, 3)", raw(values_as<std::int8_t>())))));
  CHECK(counts_up(read(npy("|u1", "(4, 3)", raw(values_as<std::uint8_t>())))));
  CHECK(counts_up(read(npy("<i2", "(4, 3)", raw(values_as<std::int16_t>())))));
  CHECK(counts_up(read(npy(">u2", "(4, 3)", raw(values_as<std::uint16_t>(), true)))));
  CHECK(counts_up(read(npy(">i4", "(4, 3)", raw(values_as<std::int32_t>(), true)))));
  CHECK(counts_up(read(npy("<u4", "(4, 3)", raw(values_as<std::uint32_t>())))));
  CHECK(counts_up(read(npy("<i8", "(4, 3)", raw(values_as<std::int64_t>())))));
  CHECK(counts_up(read(npy(">u8", "(4, 3)", raw(values_as<std::uint64_t>(), true)))));
  const std::vector<double> columns = {0, 3, 6, 9, 1, 4, 7, 10, 2, 5, 8, 11};
  CHECK(counts_up(read(npy("<f8", "(4, 3)", raw(columns), true))));
  CHECK(counts_up(read(npy("<f8", "(4, 3)", raw(kValues), false, 2))));
  CHECK(counts_up(read(npy("<f8", "(4, 3)", raw(kValues), false, 3))));
}

TEST_CASE("Three points in three rows are rows, and other shapes are refused") {
  const std::vector<double> nine(kValues.begin(), kValues.begin() + 9);
  CHECK(read(npy("<f8", "(3, 3)", raw(nine))).position[1] == Vec3(3, 4, 5));
  CHECK_REFUSES(read(npy("<f8", "(3, 4)", raw(kValues))),
                "has shape (3, 4), expected (N, 3): save its transpose");
  CHECK_REFUSES(read(npy("<f8", "(12,)", raw(kValues))), "has shape (12,), expected (N, 3)");
  CHECK_REFUSES(read(npy("<f8", "(2, 2, 3)", raw(kValues))), "has shape (2, 2, 3)");
  CHECK_REFUSES(read(npy("<f8", "()", raw(std::vector<double>{1}))), "has shape ()");
}

TEST_CASE("Arrays of objects, of records and of other numbers are refused") {
  CHECK_REFUSES(read(npy("|O", "(4, 3)", raw(kValues))), "pickled Python objects");
  CHECK_REFUSES(read(npy("<f2", "(4, 3)", std::string(24, '\0'))), "numbers of type '<f2'");
  CHECK_REFUSES(read(npy("<c16", "(4, 3)", std::string(192, '\0'))), "numbers of type '<c16'");
  std::string records = kPlaces;
  records.replace(records.find("'<f8'"), 5, "[    ");
  CHECK_REFUSES(read(records), "array of records");
}

TEST_CASE("An array with more or fewer values than its shape has is refused, however many it claims") {
  CHECK_REFUSES(read(kPlaces.substr(0, kPlaces.size() - 1)), "are not one of shape (4, 3)");
  CHECK_REFUSES(read(kPlaces + "x"), "are not one of shape (4, 3)");
  CHECK_REFUSES(read(npy("<f8", "(1000000000000, 3)", raw(kValues))), "damaged NumPy array");
  CHECK_REFUSES(read(npy("<f8", "(9223372036854775808, 9223372036854775808, 3)", "")), "damaged NumPy array");
  CHECK_REFUSES(read(npy("<f8", "(99999999999999999999, 3)", "")), "damaged header");
  CHECK_REFUSES(read(npy("<f8", "(0, 3)", "")), "holds no points");
  CHECK_REFUSES(read(kPlaces.substr(0, 40)), "ends too early");
}

TEST_CASE("An archive is read stored or deflated, with sizes in 32 or 64 bits, before or after its members") {
  for (const bool deflate : {false, true}) {
    for (const bool zip64 : {false, true}) {
      for (const bool descriptors : {false, true}) {
        INFO(deflate << zip64 << descriptors);
        ZipLayout layout{deflate, zip64, descriptors};
        layout.comment = "a comment";
        const std::string velocity = npy(">f4", "(4, 3)", raw(values_as<float>(), true));
        const PointCloud cloud =
            read(zip({{"position.npy", kPlaces}, {"unused.npy", "x"}, {"velocity.npy", velocity}}, layout));
        CHECK(counts_up(cloud));
        REQUIRE(cloud.velocity.size() == 4);
        CHECK(cloud.velocity[3] == Vec3(9, 10, 11));
      }
    }
  }
}

TEST_CASE("An archive's columns are found by their usual names, a single number being that of all") {
  const std::vector<double> four = {1, 2, 3, 4};
  std::vector<double> turns;  // F[i](j, k) = 1 where j = k, i / 8 at (0, 1)
  for (int i = 0; i < 4; ++i) turns.insert(turns.end(), {1, i / 8.0, 0, 0, 1, 0, 0, 0, 1});
  const PointCloud cloud = read(zip({{"x.npy", kPlaces},
                                     {"v.npy", kPlaces},
                                     {"volume.npy", npy("<f8", "()", raw(std::vector<double>{0.5}))},
                                     {"mass.npy", npy("<f8", "(4, 1)", raw(four))},
                                     {"pscale.npy", npy("<f8", "(4,)", raw(four))},
                                     {"density.npy", npy("<f8", "(4,)", raw(four))},
                                     {"Jp.npy", npy("<f8", "(4,)", raw(four))},
                                     {"F.npy", npy("<f8", "(4, 3, 3)", raw(turns))}}));
  CHECK(cloud.velocity[1] == Vec3(3, 4, 5));
  CHECK(cloud.volume == std::vector<double>(4, 0.5));
  for (const auto& column : {cloud.mass, cloud.radius, cloud.density, cloud.packing}) CHECK(column == four);
  CHECK(cloud.strain[2](0, 1) == 0.25f);
  CHECK(cloud.strain[2](1, 0) == 0);
  std::vector<double> fortran(36);
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 9; ++k) fortran[i + 4 * (k / 3 + 3 * (k % 3))] = turns[9 * i + k];
  }
  const std::string turned = npy("<f8", "(4, 3, 3)", raw(fortran), true);
  CHECK(read(zip({{"P.npy", kPlaces}, {"F.npy", turned}})).strain[3](0, 1) == 0.375f);
}

TEST_CASE("An archive that lacks positions, has them twice or has columns of other lengths is refused") {
  CHECK_REFUSES(read(zip({{"colour.npy", kPlaces}})),
                "holds no array 'position' of shape (N, 3), but colour");
  CHECK_REFUSES(read(zip({})), "it is empty");
  CHECK_REFUSES(read(zip({{"x.npy", kPlaces}, {"points.npy", kPlaces}})), "holds both 'points' and 'x'");
  CHECK_REFUSES(read(zip({{"x.npy", kPlaces}, {"x.npy", kPlaces}})), "two arrays named 'x'");
  CHECK_REFUSES(
      read(zip({{"x.npy", kPlaces}, {"volume.npy", npy("<f8", "(3,)", raw(std::vector<double>{1, 2, 3}))}})),
      "array 'volume': has shape (3,), expected (4,) or one number");
  CHECK_REFUSES(read(zip({{"x.npy", kPlaces}, {"F.npy", kPlaces}})), "expected (4, 3, 3)");
  CHECK_REFUSES(read(zip({{"x.npy", "not an array"}})), "array 'x': is not a NumPy array");
}

TEST_CASE("A damaged archive, or one that claims more than it can hold, is refused") {
  const std::string sound = zip({{"x.npy", kPlaces}}, {.deflate = true});
  CHECK(counts_up(read(sound)));
  CHECK_REFUSES(read(sound.substr(0, sound.size() - 1)), "has no directory");
  for (std::size_t cut = 2; cut < sound.size(); ++cut)
    CHECK(refusal([&] { read(sound.substr(0, cut)); }).code == ErrorCode::io);
  for (const bool zip64 : {false, true}) {
    CHECK_REFUSES(read(zip({{"x.npy", kPlaces}}, {.deflate = true, .zip64 = zip64, .claim = 1u << 30})),
                  "cannot have");
    CHECK_REFUSES(read(zip({{"x.npy", kPlaces}}, {.deflate = true, .zip64 = zip64, .claim = 1})),
                  "cannot be unpacked");
  }
  std::string wrong = zip({{"x.npy", kPlaces}});
  wrong[200] = static_cast<char>(wrong[200] + 1);
  CHECK_REFUSES(read(wrong), "wrong checksum of 'x.npy'");
  std::string method = sound;
  method[method.find("PK\x01\x02") + 10] = 12;
  CHECK_REFUSES(read(method), "packed with method 12");
}

TEST_CASE("A PLY file's points are the same as text and as binary of either byte order") {
  const std::string head =
      "comment made here\nobj_info nothing\nelement camera 1\nproperty list uchar float view\n"
      "element vertex 2\nproperty uchar red\nproperty double x\nproperty list uchar short tags\nproperty "
      "float y\n"
      "property int32 z\nproperty float velocity_x\nproperty float velocity_y\nproperty float velocity_z\n"
      "property float scalar_mass\nproperty uint8 pscale\nelement face 1\nproperty list uchar int "
      "vertex_indices\n";
  const auto binary = [](bool big) {
    const auto row = [big](double x, float y, std::int32_t z) {
      return std::string(1, '\x7f') + raw<double>({x}, big) + '\x02' + raw<std::int16_t>({7, 8}, big) +
             raw<float>({y}, big) + raw<std::int32_t>({z}, big) + raw<float>({1, 2, 3, 0.5f}, big) + '\x04';
    };
    return '\x03' + raw<float>({1, 2, 3}, big) + row(0.25, 1.5f, -3) + row(1e9, 2.5f, 70000) + '\x03' +
           raw<std::int32_t>({0, 1, 0}, big);
  };
  const std::string text =
      "3 1 2 3\n127 0.25 2 7 8 1.5 -3 1 2 3 0.5 4\n\n127 +1e9 2 7 8 2.5 70000 1 2 3 0.5 4\n3 0 1 0\n";
  std::string with_returns;
  for (const char c : ply("ascii", head, text))
    with_returns += c == '\n' ? std::string("\r\n") : std::string(1, c);
  for (const std::string& file :
       {ply("ascii", head, text), with_returns, ply("binary_little_endian", head, binary(false)),
        ply("binary_big_endian", head, binary(true))}) {
    const PointCloud cloud = read(file);
    REQUIRE(cloud.size() == 2);
    CHECK(cloud.position[0] == Vec3(0.25, 1.5, -3));
    CHECK(cloud.position[1] == Vec3(1e9, 2.5, 70000));
    CHECK(cloud.velocity[1] == Vec3(1, 2, 3));
    CHECK(cloud.mass == std::vector<double>{0.5, 0.5});
    CHECK(cloud.radius == std::vector<double>{4, 4});
  }
}

TEST_CASE("A PLY file that is cut off, promises too much or is not one is refused at its line or byte") {
  CHECK(read(ply("ascii", kXyz, "0 0 0\n1 1 1")).size() == 2);
  CHECK_REFUSES(read(ply("ascii", kXyz, "0 0 0\n")), "too short");
  CHECK_REFUSES(read(ply("ascii", kXyz, "0.00 0.00 0.00\n")),
                "file:8: the file ends before the last 'vertex'");
  CHECK_REFUSES(read(ply("ascii", kXyz, "0 0 0\n1 1.5\n")), "file:9: too few values");
  CHECK_REFUSES(read(ply("ascii", kXyz, "0 0 0 0\n1 1 1\n")), "file:8: too many values");
  CHECK_REFUSES(read(ply("ascii", kXyz, "0 0 0\n1 one 1\n")), "file:9: expected a number, got 'one'");
  CHECK_REFUSES(read(ply("binary_little_endian", kXyz, std::string(23, '\0'))), "too short");
  CHECK_REFUSES(
      read(ply("ascii", "element vertex 99999999999\nproperty float x\nproperty float y\nproperty float z\n",
               "0 0 0\n")),
      "promises 99999999999 elements 'vertex'");
  CHECK_REFUSES(
      read(ply("binary_big_endian", "element a 1\nproperty list uint int b\n" + kXyz, "\xff\xff\xff\xff ")),
      "longer than the file");
  CHECK_REFUSES(read(ply("binary_big_endian", "element a 1\nproperty list char int b\n" + kXyz, "\xff ")),
                "longer than the file");
  CHECK_REFUSES(read(ply("ascii", "element vertex 1\nproperty float x\nproperty float y\n", "0 0\n")),
                "lacks the property z");
  CHECK_REFUSES(read(ply("ascii", kXyz + "property float vx\n", "0 0 0 0\n0 0 0 0\n")),
                "lacks the property vy");
  CHECK_REFUSES(read(ply("ascii", "element face 0\n", "")), "has no element 'vertex'");
  CHECK_REFUSES(read(ply("ascii", "property float x\n", "")), "file:3: a property before any element");
  CHECK_REFUSES(read(ply("ascii", "element vertex 1\nproperty real x\n", "")), "'real' is no type of PLY");
  CHECK_REFUSES(read(ply("ascii", "element vertex -1\n", "")), "file:3: expected 'element'");
  CHECK_REFUSES(read("ply\nformat ascii 2.0\n"), "file:2: expected 'format ascii 1.0'");
  CHECK_REFUSES(read("ply\nformat ascii 1.0\n"), "no 'end_header'");
  CHECK_REFUSES(read("plymouth\n"), "begins with the line 'ply'");
}

TEST_CASE("Points that are not finite, and sizes that are not above 0, are refused with their number") {
  CHECK_REFUSES(read(ply("ascii", kXyz, "0 0 0\n1 nan 1\n")),
                "file: point 1, counted from 0: 'position' is (1, nan, 1), which is not finite");
  CHECK_REFUSES(read(ply("ascii", kXyz, "1e999 0 0\n1 1 1\n")),
                "point 0, counted from 0: 'position' is (inf");
  CHECK_REFUSES(read(ply("ascii", kXyz, "1e12 0 0\n1 1 1\n")), "beyond all sense");
  for (const char* value : {"0", "-1", "nan", "inf", "1e-40"}) {
    const std::string rows = std::string("0 0 0 1\n1 1 1 ") + value + "\n";
    for (const char* name : {"volume", "mass", "radius", "density"}) {
      CHECK_REFUSES(read(ply("ascii", kXyz + "property double " + name + "\n", rows)),
                    "point 1, counted from 0: '" + std::string(name) + "' is");
    }
  }
  const std::string flat = npy("<f8", "(4, 3, 3)", raw(std::vector<double>(36, 1)));
  CHECK_REFUSES(read(zip({{"x.npy", kPlaces}, {"F.npy", flat}})), "'F' has the determinant 0");
}

TEST_CASE("A particle file's points have its places, velocities, volumes and densities") {
  Snapshot snapshot(2);
  snapshot.origin = {4e5, 100, 5e6};
  snapshot.position[1][1] = 0.5f;
  snapshot.velocity[2][1] = 3;
  snapshot.volume0[0] = 1e-6f;
  snapshot.volume0[1] = 2e-6f;
  snapshot.density[0] = 400;
  snapshot.density[1] = 500;
  const PointCloud cloud = read(encode_snapshot(snapshot));
  CHECK(cloud.position[1] == Vec3(4e5, 100.5, 5e6));
  CHECK(cloud.velocity[1] == Vec3(0, 0, 3));
  CHECK(cloud.volume[1] == Approx(2e-6));
  CHECK(cloud.density[1] == 500);
}

TEST_CASE("A file of no known format is told what is read") {
  CHECK_REFUSES(read("0 0 0\n"), "these are .npz and .npy of NumPy, .ply, and firn's own particle files");
  CHECK_REFUSES(read(" BDV\x00\x00"), "OpenVDB is not read");
  CHECK_REFUSES(decode_points("x", "snow.VDB"), "OpenVDB is not read");
  CHECK_REFUSES(read(""), "no format");
}

}  // namespace firn::test::point_files
