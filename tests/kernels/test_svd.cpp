// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/particles.h"

namespace firn::test::svd {
namespace {

struct Matrices {
  std::vector<float> f[9], u[9], s[3], v[9];
  std::size_t size() const { return f[0].size(); }
  void add(const double m[9]) {
    for (int k = 0; k < 9; ++k) f[k].push_back(static_cast<float>(m[k]));
  }
  void solve(const kernels::KernelTable& table) { solve(table, size()); }
  void solve(const kernels::KernelTable& table, std::size_t count) {
    const float* in[9];
    float *uo[9], *so[3], *vo[9];
    for (int k = 0; k < 9; ++k) {
      u[k].resize(size());
      v[k].resize(size());
      in[k] = f[k].data();
      uo[k] = u[k].data();
      vo[k] = v[k].data();
    }
    for (int k = 0; k < 3; ++k) {
      s[k].resize(size());
      so[k] = s[k].data();
    }
    table.mpm.svd(in, count, uo, so, vo);
  }
};

struct Errors {
  Worst residual, u_orthogonal, v_orthogonal, u_det, v_det, order;
};

double orthogonality(const double m[9]) {
  double worst = 0;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      double d = a == b ? -1 : 0;
      for (int r = 0; r < 3; ++r) d += m[3 * r + a] * m[3 * r + b];
      if (!(std::fabs(d) <= worst)) worst = std::fabs(d);
    }
  }
  return worst;
}

Errors measure(const Matrices& m) {
  Errors e;
  for (std::size_t i = 0; i < m.size(); ++i) {
    double f[9], u[9], v[9], norm2 = 0, residual2 = 0;
    for (int k = 0; k < 9; ++k) {
      f[k] = m.f[k][i];
      u[k] = m.u[k][i];
      v[k] = m.v[k][i];
      norm2 += f[k] * f[k];
    }
    const double s[3] = {m.s[0][i], m.s[1][i], m.s[2][i]};
    for (int k = 0; k < 9; ++k) {
      double usv = 0;
      for (int c = 0; c < 3; ++c) usv += u[3 * (k / 3) + c] * s[c] * v[3 * (k % 3) + c];
      residual2 += (usv - f[k]) * (usv - f[k]);
    }
    e.residual.add(norm2 > 0 ? std::sqrt(residual2 / norm2) : std::sqrt(residual2));
    e.u_orthogonal.add(orthogonality(u));
    e.v_orthogonal.add(orthogonality(v));
    e.u_det.add(std::fabs(kernels::reference::determinant(u) - 1));
    e.v_det.add(std::fabs(kernels::reference::determinant(v) - 1));
    e.order.add(std::max({0.0, s[1] - s[0], std::fabs(s[2]) - s[1]}) / (norm2 > 0 ? std::sqrt(norm2) : 1));
  }
  return e;
}

void require_good(const Errors& e) {
  CHECK(e.residual.value() <= 1e-6);
  CHECK(e.u_orthogonal.value() <= 1e-6);
  CHECK(e.v_orthogonal.value() <= 1e-6);
  CHECK(e.u_det.value() <= 1e-6);
  CHECK(e.v_det.value() <= 1e-6);
  CHECK(e.order.value() <= 1e-6);
}

// R1 diag(s) R2^T of two random rotations.
void add_with_values(Random& random, const double s[3], Matrices& out) {
  double a[9], b[9], m[9];
  random_rotation(random, a);
  random_rotation(random, b);
  for (int k = 0; k < 9; ++k) {
    m[k] = 0;
    for (int c = 0; c < 3; ++c) m[k] += a[3 * (k / 3) + c] * s[c] * b[3 * (k % 3) + c];
  }
  out.add(m);
}

constexpr int kPerClass = 125000;  // eight classes: a million matrices

void check(Matrices& m) {
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    m.solve(table);
    require_good(measure(m));
  });
}

void check_values(const std::function<void(Random&, double s[3])>& choose, std::uint64_t seed) {
  Matrices m;
  Random random(seed);
  for (int i = 0; i < kPerClass; ++i) {
    double s[3];
    choose(random, s);
    add_with_values(random, s, m);
  }
  check(m);
}

}  // namespace

TEST_CASE("SVD of random matrices is exact to round-off, with rotations on both sides") {
  Matrices m;
  Random random(11);
  for (int i = 0; i < kPerClass; ++i) {
    double f[9];
    for (double& x : f) x = random.in(-1, 1);
    m.add(f);
  }
  check(m);
}

TEST_CASE("SVD near the identity is exact to round-off") {
  check_values(
      [](Random& r, double s[3]) {
        for (int k = 0; k < 3; ++k) s[k] = 1 + std::pow(10, r.in(-8, -1));
      },
      12);
}

TEST_CASE("SVD of rank 2, 1 and 0 is finite and its U and V are rotations") {
  check_values(
      [](Random& r, double s[3]) {
        const int rank = static_cast<int>(r.in(0, 3));
        for (int k = 0; k < 3; ++k) s[k] = k < rank ? r.in(0.1, 2) : 0;
      },
      13);
}

TEST_CASE("SVD of inverted matrices puts the sign on the smallest value") {
  check_values([](Random& r, double s[3]) { s[0] = r.in(1, 2), s[1] = r.in(0.5, 1), s[2] = -r.in(0, 0.5); },
               14);
}

TEST_CASE("SVD of ill-conditioned matrices is exact to round-off of the largest value") {
  check_values(
      [](Random& r, double s[3]) {
        s[0] = 1;
        s[1] = std::pow(10, r.in(-9, 0));
        s[2] = s[1] * std::pow(10, r.in(-9, 0));
      },
      15);
}

TEST_CASE("SVD with repeated singular values is exact to round-off") {
  check_values(
      [](Random& r, double s[3]) {
        const double other = std::pow(10, r.in(-3, 0.5));
        s[0] = s[1] = s[2] = r.in(0.5, 2);
        if (r.in(0, 1) < 0.7) s[static_cast<int>(r.in(0, 3))] = other;
      },
      16);
}

TEST_CASE("SVD of huge and tiny matrices keeps its relative accuracy") {
  check_values(
      [](Random& r, double s[3]) {
        const double scale = std::pow(10, r.in(-36, 37));
        for (int k = 0; k < 3; ++k) s[k] = scale * r.in(0, 1);
      },
      17);
}

TEST_CASE("SVD of matrices of small integers, in which all that can vanish or be equal does so exactly") {
  Matrices m;
  Random random(18);
  for (int i = 0; i < kPerClass; ++i) {  // all 19683 of -1, 0 and 1, then up to +-3
    double f[9];
    for (int k = 0, digits = i; k < 9; ++k, digits /= 3) {
      f[k] = i < 19683 ? digits % 3 - 1 : std::floor(random.in(-3, 4));
    }
    m.add(f);
  }
  check(m);
}

TEST_CASE("SVD has the same bits on x86-64-v3 and x86-64-v4, in any company") {
  const auto tables = supported_kernels();
  if (tables.size() < 3) return;
  Matrices whole, shifted;
  Random random(19);
  for (int i = 0; i < 4099; ++i) {
    double s[3], f[9];
    for (double& x : s) x = std::pow(10, random.in(-6, 2));
    add_with_values(random, s, whole);
    for (int k = 0; k < 9; ++k) f[k] = whole.f[k].back();
    if (i >= 5) shifted.add(f);  // so that it meets other neighbours
  }
  whole.solve(*tables[1]);
  shifted.solve(*tables[2]);
  int differences = 0;
  const auto compare = [&](const std::vector<float>& a, const std::vector<float>& b) {
    differences += std::memcmp(a.data() + 5, b.data(), b.size() * sizeof(float)) != 0;
  };
  for (int k = 0; k < 9; ++k) {
    compare(whole.u[k], shifted.u[k]);
    compare(whole.v[k], shifted.v[k]);
  }
  for (int k = 0; k < 3; ++k) compare(whole.s[k], shifted.s[k]);
  CHECK(differences == 0);
}

TEST_CASE("SVD of 1 to 17 matrices gives each its own bits and writes nothing behind them") {
  Matrices whole;
  Random random(20);
  for (int i = 0; i < 17; ++i) {
    const double s[3] = {random.in(1, 2), random.in(0, 1), random.in(-1, 1)};
    add_with_values(random, s, whole);
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    whole.solve(table);
    int differences = 0;
    for (std::size_t count = 1; count <= 17; ++count) {
      Matrices part = whole;
      const auto fill = [](auto& columns) {
        for (auto& column : columns) column.assign(17, -7.f);
      };
      fill(part.u), fill(part.s), fill(part.v);
      part.solve(table, count);
      const auto compare = [&](const auto& columns, const auto& expected) {
        for (std::size_t k = 0; k < std::size(columns); ++k) {
          for (std::size_t i = 0; i < 17; ++i)
            differences += columns[k][i] != (i < count ? expected[k][i] : -7.f);
        }
      };
      compare(part.u, whole.u), compare(part.s, whole.s), compare(part.v, whole.v);
    }
    CHECK(differences == 0);
  });
}

TEST_CASE("SVD finds the singular values of the double reference") {
  Matrices m;
  Random random(17);
  for (int i = 0; i < 5003; ++i) {
    double f[9];
    for (double& x : f) x = random.in(-1, 1);
    m.add(f);
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    m.solve(table);
    Worst error;
    for (std::size_t i = 0; i < m.size(); ++i) {
      double f[9], u[9], s[3], v[9];
      for (int k = 0; k < 9; ++k) f[k] = m.f[k][i];
      kernels::reference::svd(f, u, s, v);
      for (int k = 0; k < 3; ++k) error.add(std::fabs(s[k] - m.s[k][i]) / s[0]);
    }
    CHECK(error.value() <= 1e-6);
  });
}

}  // namespace firn::test::svd
