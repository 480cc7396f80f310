// SPDX-License-Identifier: MIT
// Pixel filters: what is sampled is what is evaluated.
#include <cmath>
#include <vector>

#include "src/render/film/filter.h"
#include "tests/catch.h"

namespace firn::test::filter {
namespace {

struct Case {
  const char* name;
  FilterKind kind;
  double width;  // pixels
};
const std::vector<Case> kCases = {{"box", FilterKind::box, 1},
                                  {"wide box", FilterKind::box, 2.5},
                                  {"tent", FilterKind::tent, 2},
                                  {"gaussian", FilterKind::gaussian, 3},
                                  {"blackman_harris", FilterKind::blackman_harris, 4}};

double integral(const PixelFilter& filter, double from, double to) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += filter.density(from + (to - from) * (i + 0.5) / kSteps);
  return sum * (to - from) / kSteps;
}

}  // namespace

TEST_CASE("a filter's density is 1 in all, even, and 0 beyond its width") {
  for (const Case& c : kCases) {
    const PixelFilter filter(c.kind, c.width);
    INFO(c.name);
    CHECK(filter.radius() == c.width / 2);
    CHECK(integral(filter, -c.width / 2, c.width / 2) == Approx(1).epsilon(1e-5));
    CHECK(filter.density(c.width / 2 + 1e-9) == 0);
    for (double x = 0; x < c.width / 2; x += 0.01) {
      REQUIRE(filter.density(x) == filter.density(-x));
      REQUIRE(filter.density(x) >= 0);
      REQUIRE(filter.density(x) <= filter.density(0));
    }
  }
}

// The part of all samples below x is the integral of the density up to x: to the 1/4096 of an even u.
TEST_CASE("samples of a filter follow its density") {
  constexpr int kCount = 4096;
  for (const Case& c : kCases) {
    const PixelFilter filter(c.kind, c.width);
    double before = -c.width / 2 - 1e-9;
    for (int i = 0; i < kCount; ++i) {
      const double x = filter.sample((static_cast<float>(i) + 0.5f) / kCount);
      INFO(c.name << ", sample " << i);
      REQUIRE(x >= before);
      REQUIRE(std::fabs(x) <= c.width / 2);
      if (i % 512 == 256)
        REQUIRE(integral(filter, -c.width / 2, x) == Approx((i + 0.5) / kCount).margin(1e-5));
      before = x;
    }
    CHECK(std::fabs(filter.sample(0)) == Approx(c.width / 2));
    CHECK(std::fabs(filter.sample(0.99999994f)) <= c.width / 2);
  }
}

// sigma of the lowered Gaussian: between that of the curve (width / 6) and 0.95 of it, since its tails are
// cut; variances of the others in closed form.
TEST_CASE("filters are as wide as they are said to be") {
  const auto variance = [](FilterKind kind, double width) {
    const PixelFilter filter(kind, width);
    double sum = 0;
    for (int i = 0; i < 65536; ++i) sum += std::pow(filter.sample((static_cast<float>(i) + 0.5f) / 65536), 2);
    return sum / 65536;
  };
  CHECK(variance(FilterKind::box, 3) == Approx(9.0 / 12).epsilon(1e-4));
  CHECK(variance(FilterKind::tent, 3) == Approx(1.5 * 1.5 / 6).epsilon(1e-4));
  CHECK(std::sqrt(variance(FilterKind::gaussian, 3)) < 0.5);
  CHECK(std::sqrt(variance(FilterKind::gaussian, 3)) > 0.475);
  // Of sum a_k cos(pi k x / r): r^2 / 3 + sum of 4 a_k / a_0 (-1)^k r^2 / (2 pi^2 k^2).
  const double r = 2, a[] = {0.35875, 0.48829, 0.14128, 0.01168};
  double expected = r * r / 3;
  for (int k = 1; k < 4; ++k) expected += 2 * a[k] / a[0] * (k % 2 ? -1 : 1) * r * r / (M_PI * M_PI * k * k);
  CHECK(variance(FilterKind::blackman_harris, 4) == Approx(expected).epsilon(2e-3));
}

}  // namespace firn::test::filter
