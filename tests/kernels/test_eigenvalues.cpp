// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/lane_parts.h"
#include "tests/kernels/particles.h"

namespace firn::test::eigenvalues {
namespace {

constexpr std::size_t kMatrices = 40000;

struct SymmetricMatrices {
  std::vector<float> entry[6];  // xx yy zz xy xz yz

  void add(const Eigen::Matrix3d& a) {
    const double entries[6] = {a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(0, 2), a(1, 2)};
    for (int k = 0; k < 6; ++k) entry[k].push_back(static_cast<float>(entries[k]));
  }
  Eigen::Matrix3d at(std::size_t i) const {
    Eigen::Matrix3d a;
    a << entry[0][i], entry[3][i], entry[4][i], entry[3][i], entry[1][i], entry[5][i], entry[4][i],
        entry[5][i], entry[2][i];
    return a;
  }
};

// Largest error of the lanes' ascending eigenvalues, relative to the largest of them.
double eigenvalue_error(const kernels::KernelTable& table, const SymmetricMatrices& m) {
  const float* in[6];
  for (int k = 0; k < 6; ++k) in[k] = m.entry[k].data();
  std::vector<float> values[3];
  float* out[3];
  for (int k = 0; k < 3; ++k) {
    values[k].resize(kMatrices);
    out[k] = values[k].data();
  }
  lane_parts_of(table).eigenvalues(in, kMatrices, out);
  Worst error;
  for (std::size_t i = 0; i < kMatrices; ++i) {
    const Eigen::Vector3d expected =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m.at(i), Eigen::EigenvaluesOnly).eigenvalues();
    const double largest = std::max(expected.cwiseAbs().maxCoeff(), 1e-30);
    for (int k = 0; k < 3; ++k) error.add(std::fabs(values[k][i] - expected[k]) / largest);
  }
  return error.value();
}

// Of R diag(e) R^T with random rotations R.
void check_spectrum(const std::function<void(Random&, double e[3])>& choose, std::uint64_t seed) {
  SymmetricMatrices m;
  Random random(seed);
  for (std::size_t i = 0; i < kMatrices; ++i) {
    double e[3], r[9];
    choose(random, e);
    random_rotation(random, r);
    const Eigen::Map<const Eigen::Matrix3d> rotation(r);
    m.add(rotation * Eigen::Vector3d(e[0], e[1], e[2]).asDiagonal() * rotation.transpose());
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    CHECK(eigenvalue_error(table, m) < 1e-6);
  });
}

}  // namespace

TEST_CASE("closed-form eigenvalues of random symmetric matrices are exact to round-off of the largest") {
  check_spectrum(
      [](Random& r, double e[3]) {
        for (int k = 0; k < 3; ++k) e[k] = r.in(-1, 1);
      },
      51);
}

TEST_CASE("closed-form eigenvalues are as exact where two or three of them meet, or nearly do") {
  check_spectrum(
      [](Random& r, double e[3]) {
        const double gap = r.in(0, 1) < 0.3 ? 0 : std::pow(10, r.in(-9, -1));
        e[0] = r.in(-1, 1);
        e[1] = e[0] + gap;
        e[2] = r.in(0, 1) < 0.3 ? e[0] - gap : r.in(-1, 1);
      },
      52);
}

TEST_CASE("closed-form eigenvalues of strains of any size are as exact") {
  check_spectrum(
      [](Random& r, double e[3]) {
        const double size = std::pow(10, r.in(-9, 4));
        for (int k = 0; k < 3; ++k) e[k] = size * r.in(-1, 1) * std::pow(10, r.in(-6, 0));
      },
      53);
}

TEST_CASE(
    "closed-form eigenvalues of matrices of small integers, zero and the identity among them, are as exact") {
  SymmetricMatrices m;
  for (std::size_t i = 0; i < kMatrices; ++i) {
    Eigen::Matrix3d a;
    for (int k = 0, digits = static_cast<int>(i); k < 6; ++k, digits /= 5) {
      const int r = k < 3 ? k : k == 5, c = k < 3 ? k : k == 3 ? 1 : 2;
      a(r, c) = a(c, r) = digits % 5 - 2;
    }
    m.add(a);
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    CHECK(eigenvalue_error(table, m) < 1e-6);
  });
}

}  // namespace firn::test::eigenvalues
