// SPDX-License-Identifier: MIT
// Sample points, directions, and the portable functions under them.
#include <cmath>
#include <vector>

#include "src/core/isa.h"
#include "src/core/portable_math.h"
#include "src/core/rng.h"
#include "src/render/sampling/directions.h"
#include "src/render/sampling/sampler.h"
#include "tests/catch.h"

using namespace firn;

TEST_CASE("every dyadic box of area 1/16 holds one of 16 samples, in every pair of dimensions") {
  for (std::uint32_t pair = 0; pair < 20; ++pair) {
    const Sampler sampler(7, 3, 1234 + pair);
    for (int bits = 0; bits <= 4; ++bits) {
      std::vector<int> seen(16, 0);
      for (std::uint32_t s = 0; s < 16; ++s) {
        const Sample2 at = sampler.pair(s, pair);
        REQUIRE((at.u >= 0 && at.u < 1 && at.v >= 0 && at.v < 1));
        const int column = static_cast<int>(at.u * static_cast<float>(1 << bits));
        const int row = static_cast<int>(at.v * static_cast<float>(16 >> bits));
        ++seen[column * (16 >> bits) + row];
      }
      for (const int count : seen) REQUIRE(count == 1);
    }
  }
}

TEST_CASE("paths draw the same numbers many at once as one by one") {
  for (const auto* table : supported_kernels()) {
    for (const SamplerKind kind : {SamplerKind::sobol, SamplerKind::independent}) {
      PathDraws draws;
      std::vector<PathRandom> paths;
      std::vector<std::uint32_t> numbers;
      constexpr std::uint32_t kStreams[] = {0, 1u << 30, 1u << 31, 3u << 30};
      for (std::uint32_t i = 0; i < 1003; ++i) {  // fills no register
        paths.emplace_back(Sampler(5, 2, i / 3), i % 67, kind);
        numbers.push_back(kStreams[i % 4] + i % 53);
        draws.push(paths.back(), numbers.back());
      }
      constexpr std::uint32_t kPlus = 7;
      std::vector<float> u(draws.size(), -1), v(draws.size(), -1);
      std::vector<std::uint64_t> key(draws.size());
      table->shade.pairs(draws.view(), kPlus, 0, 600, u.data(), v.data());
      table->shade.pairs(draws.view(), kPlus, 600, draws.size(), u.data(), v.data());
      table->shade.keys(draws.view(), kPlus, 0, draws.size(), key.data());
      for (std::size_t i = 0; i < draws.size(); ++i) {
        INFO(table->isa << ", draw " << i);
        const Sample2 one = paths[i].pair(numbers[i] + kPlus);
        REQUIRE((u[i] == one.u && v[i] == one.v));
        REQUIRE(key[i] == paths[i].key(~(numbers[i] + kPlus)));
      }
    }
  }
}

TEST_CASE("samples of different pixels and pairs are not correlated") {
  double sum = 0, pairs = 0;
  for (std::uint64_t pixel = 0; pixel < 20000; ++pixel) {
    const Sampler sampler(1, 0, pixel);
    sum += (sampler.pair(0, 1).u - 0.5) * (Sampler(1, 0, pixel + 1).pair(0, 1).u - 0.5);
    pairs += (sampler.pair(0, 1).u - 0.5) * (sampler.pair(0, 2).u - 0.5);
  }
  CHECK(std::fabs(sum / 20000) < 5.0 / 12 / std::sqrt(20000));
  CHECK(std::fabs(pairs / 20000) < 5.0 / 12 / std::sqrt(20000));
}

TEST_CASE("cosine directions have the mean 2/3 along the normal and stay above the surface") {
  for (const Vec3f& n : {Vec3f(0, 0, 1), Vec3f(0, 0, -1), Vec3f(0.6f, -0.8f, 0)}) {
    const Sampler sampler(2, 0, 9);
    Vec3f sum = Vec3f::Zero();
    for (std::uint32_t s = 0; s < 4096; ++s) {
      const Vec3f d = cosine_direction(n, sampler.pair(s, 0));
      REQUIRE(d.norm() == Approx(1).epsilon(1e-5));
      REQUIRE(d.dot(n) >= 0);
      sum += d;
    }
    CHECK((sum / 4096 - n * (2.f / 3)).norm() < 2e-3f);
  }
}

TEST_CASE("portable functions agree with libm") {
  for (int i = 0; i < 20000; ++i) {
    const double u = uniform_double(hash_keys(5, i)), v = uniform_double(hash_keys(6, i));
    const double angle = 2000 * (u - 0.5);
    REQUIRE(std::fabs(portable_sincos(angle).sin - std::sin(angle)) < 1e-13);
    REQUIRE(std::fabs(portable_sincos(angle).cos - std::cos(angle)) < 1e-13);
    const SinCosf turned = portable_sincos_turn(static_cast<float>(u));
    const double turn = 2 * M_PI * static_cast<float>(u);
    REQUIRE(std::fabs(turned.sin - std::sin(turn)) < 2e-7);
    REQUIRE(std::fabs(turned.cos - std::cos(turn)) < 2e-7);
    REQUIRE(std::fabs(portable_acos(2 * u - 1) - std::acos(2 * u - 1)) < 1e-13);
    const double x = std::exp(100 * (v - 0.5));
    REQUIRE(portable_log(x) == Approx(std::log(x)).epsilon(1e-13).margin(1e-14));
    const auto xf = static_cast<float>(x);
    REQUIRE(portable_logf(xf) == Approx(std::log(static_cast<double>(xf))).epsilon(2e-7).margin(2e-7));
    const auto exponent = static_cast<float>(170 * (u - 0.5));
    const Eigen::Array4f powers = portable_expf({exponent, 0.5f * exponent, 0, -1});
    REQUIRE(powers[0] == Approx(std::exp(static_cast<double>(exponent))).epsilon(3e-7));
    REQUIRE(powers[1] == Approx(std::exp(0.5 * static_cast<double>(exponent))).epsilon(3e-7));
    REQUIRE(portable_exp(100 * (u - 0.5)) == Approx(std::exp(100 * (u - 0.5))).epsilon(1e-13));
    REQUIRE(portable_cbrt(x) == Approx(std::cbrt(x)).epsilon(1e-13));
    REQUIRE(portable_pow(x, u) == Approx(std::pow(x, u)).epsilon(2e-13));
  }
  CHECK(portable_exp(-1000) == 0);
  const Eigen::Array4f powers = portable_expf({-100, -INFINITY, 0, -1e30f});
  CHECK((powers == Eigen::Array4f(0, 0, 1, 0)).all());
  CHECK(portable_logf(1) == 0);
  CHECK(portable_cbrt(0) == 0);
  CHECK(portable_acos(1) == 0);
}
