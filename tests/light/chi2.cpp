// SPDX-License-Identifier: MIT
#include "tests/light/chi2.h"

#include <algorithm>
#include <cmath>

#include "src/core/rng.h"
#include "src/render/sampling/directions.h"

namespace firn::test {
namespace {

constexpr int kSide = 24;      // cells
constexpr int kInCell = 40;    // points a side that a cell's expectation is taken from
constexpr double kFewest = 8;  // expected in a cell; those with fewer are counted together
constexpr double kTwoPi = 6.283185307179586;

// The cell of a direction, or -1 outside.
int cell_of(const Vec3f& d, const Cone& cone) {
  const Vec3f x = around(cone.axis, 1, 0, 0), y = around(cone.axis, 0, 1, 0);
  const double down = 0.5 * (d - cone.axis).cast<double>().squaredNorm() / cone.spread;
  if (d.squaredNorm() == 0 || down >= 1) return -1;
  const double turn = std::atan2(d.dot(y), d.dot(x)) / kTwoPi;
  const int column = static_cast<int>((turn < 0 ? turn + 1 : turn) * kSide) % kSide;
  return static_cast<int>(down * kSide) * kSide + column;
}

Sample2 middle(int i, int j, int side) {
  const auto n = static_cast<float>(side);
  return {(static_cast<float>(i) + 0.5f) / n, (static_cast<float>(j) + 0.5f) / n};
}

}  // namespace

Sample2 random_pair(std::uint64_t seed, std::uint64_t index, std::uint64_t which) {
  return {uniform_float(hash_keys(seed, index, which, 0)), uniform_float(hash_keys(seed, index, which, 1))};
}

double integrate(const std::function<double(const Vec3f&)>& f, const Cone& cone, int side) {
  double sum = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) sum += f(cone_direction(cone.axis, cone.spread, middle(i, j, side)));
  }
  return sum / side / side * kTwoPi * cone.spread;
}

double chi_squared_z(const std::function<Vec3f(std::uint64_t)>& draw, std::uint64_t count,
                     const std::function<double(const Vec3f&)>& density, const Cone& cone) {
  const int cells = kSide * kSide;
  std::vector<double> seen(cells + 1, 0), expected(cells + 1, 0);
  for (std::uint64_t k = 0; k < count; ++k) {
    const int cell = cell_of(draw(k), cone);
    ++seen[cell < 0 ? cells : cell];
  }
  const int fine = kSide * kInCell;
  double rest = 1;
  for (int i = 0; i < fine; ++i) {
    for (int j = 0; j < fine; ++j) {
      const double p = density(cone_direction(cone.axis, cone.spread, middle(i, j, fine))) * kTwoPi *
                       cone.spread / fine / fine;
      expected[i / kInCell * kSide + j / kInCell] += p * static_cast<double>(count);
      rest -= p;
    }
  }
  expected[cells] = std::max(rest, 0.0) * static_cast<double>(count);
  double few_seen = 0, few_expected = 0, sum = 0, degrees = -1;
  const auto add = [&](double s, double e) { sum += (s - e) * (s - e) / e, ++degrees; };
  for (int k = 0; k <= cells; ++k) {
    if (expected[k] >= kFewest) {
      add(seen[k], expected[k]);
    } else {
      few_seen += seen[k], few_expected += expected[k];
    }
  }
  if (few_expected >= kFewest) add(few_seen, few_expected);
  // What is drawn where nothing may be counts as if one were expected.
  if (few_expected < kFewest) sum += std::max(0.0, few_seen - few_expected - 3 * std::sqrt(few_expected) - 1);
  const double spread = 2 / (9 * degrees);
  return (std::cbrt(sum / degrees) - (1 - spread)) / std::sqrt(spread);
}

}  // namespace firn::test
