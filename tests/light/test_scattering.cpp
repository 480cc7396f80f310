// SPDX-License-Identifier: MIT
// Surfaces: what is drawn has the density that is claimed, light goes both ways alike, and none is made.
#include <cmath>
#include <utility>
#include <vector>

#include "src/render/sampling/directions.h"
#include "src/render/solids/facet_energy.h"
#include "src/render/solids/scattering.h"
#include "tests/catch.h"
#include "tests/light/chi2.h"

namespace firn::test::scattering {
namespace {

const Vec3f kNormal = Vec3f(0.48f, 0.6f, -0.64f);

SurfacePoint surface(SurfaceKind kind, float roughness = 0.5f,
                     const Vec3f& albedo = Vec3f(0.2f, 0.5f, 0.9f)) {
  return {kind, kNormal, albedo, roughness, 1.5f};
}

std::vector<SurfacePoint> rough_surfaces() {
  std::vector<SurfacePoint> all{surface(SurfaceKind::diffuse)};
  for (const float roughness : {0.3f, 0.5f, 0.8f, 1.f})
    all.push_back(surface(SurfaceKind::glossy, roughness));
  return all;
}

// A direction with this cosine to the normal.
Vec3f at_cosine(float cosine, float turn = 0.3f) {
  const Disc disc = on_circle(std::sqrt(1 - cosine * cosine), turn);
  return around(kNormal, disc.x, disc.y, cosine).normalized();
}

Vec3f anywhere(std::uint64_t index) { return cone_direction(Vec3f::UnitY(), 2, random_pair(11, index, 0)); }

bool draw(const SurfacePoint& point, const Vec3f& wo, std::uint64_t index, Scattered& out,
          Carries carries = Carries::radiance) {
  return scatter(point, wo, random_pair(5, index, 0).u, random_pair(5, index, 1), carries, out);
}

// Mean weight: the part of the light that is not absorbed.
double reflectance(const SurfacePoint& point, const Vec3f& wo, int count) {
  double sum = 0;
  Scattered out;
  for (int k = 0; k < count; ++k) sum += draw(point, wo, k, out) ? out.weight.y() : 0.f;
  return sum / count;
}

}  // namespace

TEST_CASE("rough surfaces draw directions with their density", "[light]") {
  for (const SurfacePoint& point : rough_surfaces()) {
    for (const float cosine : {0.95f, 0.5f, 0.15f, -0.6f}) {
      const Vec3f wo = at_cosine(cosine);
      const double z = chi_squared_z(
          [&](std::uint64_t k) {
            Scattered out;
            return draw(point, wo, k, out) ? out.direction : Vec3f(Vec3f::Zero());
          },
          100000, [&](const Vec3f& wi) { return density(point, wo, wi); });
      INFO("roughness " << point.roughness << ", cosine " << cosine);
      CHECK(std::fabs(z) < 4.5);
    }
  }
}

TEST_CASE("what scatter says of its way agrees with evaluate() and density()", "[light]") {
  for (const SurfacePoint& point : rough_surfaces()) {
    REQUIRE_FALSE(is_specular(point));
    for (std::uint64_t k = 0; k < 2000; ++k) {
      const Vec3f wo = anywhere(k);
      Scattered out;
      if (!draw(point, wo, k, out)) continue;
      const Vec3f& wi = out.direction;
      const float cosine = std::fabs(kNormal.dot(wi));
      REQUIRE(wi.norm() == Approx(1).epsilon(1e-5));
      REQUIRE(out.pdf == Approx(density(point, wo, wi)).epsilon(1e-4));
      REQUIRE(out.pdf_reverse == Approx(density(point, wi, wo)).epsilon(1e-4));
      const Vec3f weight = evaluate(point, wo, wi) * (cosine / density(point, wo, wi));
      REQUIRE((out.weight - weight).norm() < 1e-4f * weight.norm());
    }
  }
}

TEST_CASE("rough surfaces reflect both ways alike and let nothing through", "[light]") {
  for (const SurfacePoint& point : rough_surfaces()) {
    for (std::uint64_t k = 0; k < 4000; ++k) {
      const Vec3f wo = anywhere(2 * k), wi = anywhere(2 * k + 1);
      const Vec3f one = evaluate(point, wo, wi), other = evaluate(point, wi, wo);
      REQUIRE((one - other).norm() <= 1e-4f * one.norm());
      const bool same_side = kNormal.dot(wo) * kNormal.dot(wi) > 0;
      REQUIRE((one.minCoeff() > 0) == same_side);
    }
  }
}

TEST_CASE("in a white furnace white diffuse, mirror and glass are white", "[light]") {
  const Vec3f white = Vec3f::Ones();
  Scattered out;
  for (const SurfaceKind kind :
       {SurfaceKind::diffuse, SurfaceKind::mirror, SurfaceKind::dielectric, SurfaceKind::none}) {
    for (std::uint64_t k = 0; k < 2000; ++k) {
      const Vec3f wo = anywhere(k);
      REQUIRE(draw(surface(kind, 0, white), wo, k, out, Carries::importance));
      REQUIRE((out.weight - white).norm() < 1e-5f);  // flux is kept in every single draw
      // Radiance behind glass is brighter by the square of its index, so that too is white.
      REQUIRE(draw(surface(kind, 0, white), wo, k, out, Carries::radiance));
      const bool through = kNormal.dot(wo) * kNormal.dot(out.direction) < 0;
      const bool bent = through && kind == SurfaceKind::dielectric;
      const float behind = !bent ? 1 : kNormal.dot(wo) > 0 ? 2.25f : 1 / 2.25f;
      REQUIRE((out.weight * behind - white).norm() < 1e-5f);
    }
  }
}

TEST_CASE("in a white furnace white glossy surfaces are white, however rough", "[light]") {
  const Vec3f white = Vec3f::Ones();
  for (const float roughness : {0.1f, 0.3f, 0.5f, 0.64f, 0.8f, 1.f}) {
    for (const float cosine : {0.1f, 0.31f, 0.5f, 1.f}) {
      const SurfacePoint point = surface(SurfaceKind::glossy, roughness, white);
      const Vec3f wo = at_cosine(cosine);
      INFO("roughness " << roughness << ", cosine " << cosine);
      CHECK(reflectance(point, wo, 100000) == Approx(1).margin(0.005));
      if (roughness < 0.3f) continue;  // too sharp for the quadrature
      const double integral =
          integrate([&](const Vec3f& wi) { return evaluate(point, wo, wi).y() * std::fabs(kNormal.dot(wi)); },
                    {kNormal, 1});
      CHECK(integral == Approx(1).margin(0.008));
    }
  }
}

TEST_CASE("one facet reflects what the closed form and the literature say", "[light]") {
  // Walter's alpha of 1, from straight above: 2 (1/2 - ln(2) / 2).
  CHECK(facet_energy(1, 1) == Approx(1 - std::log(2)).margin(0.001));
  for (const auto& [roughness, lost] : {std::pair(0.3f, 0.02), {0.5f, 0.12}, {0.7f, 0.29}, {1.f, 0.59}})
    CHECK(1 - mean_facet_energy(roughness) == Approx(lost).margin(0.01));
  CHECK(facet_energy(0, 0.3f) == 1);
}

TEST_CASE("a glossy surface of little roughness is a mirror", "[light]") {
  const SurfacePoint point = surface(SurfaceKind::glossy, 0.02f, Vec3f::Ones());
  for (std::uint64_t k = 0; k < 500; ++k) {
    const Vec3f wo = at_cosine(0.3f + 0.7f * random_pair(1, k, 0).u);
    Scattered out;
    REQUIRE(draw(point, wo, k, out));
    const Vec3f mirrored = 2 * kNormal.dot(wo) * kNormal - wo;
    REQUIRE((out.direction - mirrored).norm() < 0.05f);
    REQUIRE(out.weight.y() == Approx(1).margin(0.01));
  }
}

TEST_CASE("glass follows Snell and Fresnel from both sides", "[light]") {
  const SurfacePoint glass = surface(SurfaceKind::dielectric);
  Scattered out;
  const auto reflected_part = [&](float cosine) {
    const Vec3f wo = at_cosine(cosine);
    REQUIRE(scatter(glass, wo, 0, {0, 0}, Carries::radiance, out));
    return out.pdf;
  };
  CHECK(reflected_part(1) == Approx(0.04).epsilon(1e-4));  // ((n - 1) / (n + 1))^2
  CHECK(reflected_part(-1) == Approx(0.04).epsilon(1e-4));
  // At Brewster's angle (tan = n) only the half that is polarised across is reflected: ((n^2 - 1) / (n^2 +
  // 1))^2 / 2.
  CHECK(reflected_part(1 / std::sqrt(3.25f)) == Approx(0.5 * std::pow(1.25 / 3.25, 2)).epsilon(1e-4));
  // Total reflection from within beyond sin = 1 / n, that is below cos = sqrt(5) / 3.
  CHECK(reflected_part(-0.745f) == 1);
  CHECK(reflected_part(-0.746f) < 1);
  for (std::uint64_t k = 0; k < 2000; ++k) {
    const Vec3f wo = anywhere(k);
    REQUIRE(draw(glass, wo, k, out));
    const Vec3f along_o = wo - kNormal.dot(wo) * kNormal,
                along_i = out.direction - kNormal.dot(out.direction) * kNormal;
    const float n_o = kNormal.dot(wo) > 0 ? 1.f : 1.5f, n_i = kNormal.dot(out.direction) > 0 ? 1.f : 1.5f;
    REQUIRE((n_o * along_o + n_i * along_i).norm() < 1e-5f);
  }
}

TEST_CASE("the way back through glass has the chance that was said, over the same delta", "[light]") {
  const SurfacePoint glass = surface(SurfaceKind::dielectric);
  for (std::uint64_t k = 0; k < 2000; ++k) {
    const Vec3f wo = anywhere(k);
    Scattered out, back;
    if (std::fabs(kNormal.dot(wo)) < 0.05f || !draw(glass, wo, k, out)) continue;
    const bool through = kNormal.dot(wo) * kNormal.dot(out.direction) < 0;
    REQUIRE(scatter(glass, out.direction, through ? 0.9999999f : 0.f, {0, 0}, Carries::radiance, back));
    REQUIRE((back.direction - wo).norm() < 1e-3f);
    const float n_o = kNormal.dot(wo) > 0 ? 1.f : 1.5f, n_i = kNormal.dot(out.direction) > 0 ? 1.f : 1.5f;
    const float spread =
        n_o * n_o * std::fabs(kNormal.dot(wo)) / (n_i * n_i * std::fabs(kNormal.dot(out.direction)));
    REQUIRE(out.pdf_reverse == Approx(back.pdf * spread).epsilon(2e-3));
  }
}

TEST_CASE("what glows absorbs, and where no surface is light goes on", "[light]") {
  Scattered out;
  const Vec3f wo = at_cosine(0.4f);
  CHECK_FALSE(draw(surface(SurfaceKind::emission), wo, 0, out));
  REQUIRE(draw(surface(SurfaceKind::none), wo, 0, out));
  CHECK(out.direction == Vec3f(-wo));
  CHECK(out.specular);
}

}  // namespace firn::test::scattering
