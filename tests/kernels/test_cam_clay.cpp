// SPDX-License-Identifier: MIT
// Cam-Clay snow: the kernel is the reference's, and the reference keeps its own laws.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/lane_parts.h"
#include "tests/kernels/material_laws.h"
#include "tests/kernels/particles.h"

namespace firn::test::cam_clay {
namespace {

kernels::MaterialParams clay(float slope2, float beta, float alpha0, float hardening) {
  kernels::MaterialParams m =
      params_of<kernels::CamClay>({{}, 1, 4e4f, 6e4f, 1.f / 300, 0, 0, hardening, 0.3f, 20.f});
  m.slope2 = slope2;
  m.beta = beta;
  m.alpha0 = alpha0;
  return m;
}

// xi below 1: else p0 falls faster than elastic strain is set free, and all is gone in a snap.
kernels::MaterialParams collapsing() {
  kernels::MaterialParams m = clay(0.6f, 0.2f, -0.02f, 0.5f);
  m.collapse = 0.01f;
  m.jp_broken = std::exp(0.02f);
  return m;
}
constexpr std::uint32_t kCollapsing = 3;

// Strong, weak, without tension, a layer that collapses; and snow between them.
std::vector<kernels::MaterialParams> clay_materials() {
  return {clay(0.8f, 0.3f, -0.02f, 2), clay(0.5f, 0.5f, -0.002f, 1), clay(1.2f, 0, -0.05f, 5), collapsing(),
          test_materials()[0]};
}

// Every other particle of the layer that collapses has done so.
void break_some(const ParticleColumns& columns) {
  for (std::size_t i = 0; i < columns.size(); i += 2) {
    if (columns.view().object[i] == kCollapsing) columns.view().Jp[i] *= -1;
  }
}

// Jp within a few per cent of the start.
ParticleColumns clay_particles(std::size_t count, std::uint64_t seed, double strain, std::uint32_t objects) {
  ParticleColumns columns = random_particles(count, seed, strain, objects);
  Random random(seed + 1);
  for (std::size_t i = 0; i < count; ++i) columns.view().Jp[i] = static_cast<float>(random.in(0.96, 1.03));
  break_some(columns);
  return columns;
}

double kappa_of(const kernels::MaterialParams& m) { return m.lambda + 2.0 / 3 * m.mu; }

// The yield function over kappa^2 with the strength of `jp`; positive outside.
double outside_ellipse(const kernels::MaterialParams& m, const double f[9], double jp) {
  double tau[9], s2 = 0;
  kernels::reference::stress(m, f, jp, tau);
  const double pressure = -(tau[0] + tau[4] + tau[8]) / 3;
  for (int k = 0; k < 9; ++k) s2 += std::pow(tau[k] + (k % 4 == 0 ? pressure : 0), 2);
  const double packed = std::max(-((jp < 0 ? m.collapse : m.alpha0) + std::log(std::fabs(jp))), 0.0);
  const double p0 = kappa_of(m) * (1e-5 + std::sinh(m.hardening * packed)), beta = jp < 0 ? 0 : m.beta;
  const double y = 1.5 * (1 + 2 * beta) * s2 + m.slope2 * (pressure + beta * p0) * (pressure - p0);
  return y / std::pow(kappa_of(m), 2);
}

}  // namespace

TEST_CASE("stress, energy and wave speed of clay are the reference's, near a rotation and far from it") {
  const auto materials = clay_materials();
  for (const double strain : {0.001, 0.05, 0.4}) {
    const ParticleColumns columns = clay_particles(2053, 140, strain, 4);
    const auto particles = reference_particles(columns);
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << " strain " << strain);
      const std::size_t n = columns.size();
      std::vector<float> tau(6 * n), energy(n);
      table.mpm.stress(materials.data(), columns.view(), {0, n}, tau.data(), n);
      table.mpm.elastic_energy(materials.data(), columns.view(), {0, n}, energy.data());
      Worst stress_error, energy_error, wave_error;
      constexpr int kSymmetric[6] = {0, 4, 8, 1, 2, 5};
      for (std::size_t i = 0; i < n; ++i) {
        const auto& m = materials[particles[i].object];
        const double j = kernels::reference::determinant(particles[i].F);
        const double noise = 1 / std::clamp(j * j, 1e-4, 1.0);  // J^(-2/3) of a J with round-off
        double expected[9];
        kernels::reference::stress(m, particles[i].F, particles[i].Jp, expected);
        for (int k = 0; k < 6; ++k) {
          stress_error.add(std::fabs(tau[k * n + i] - expected[kSymmetric[k]]) / (2 * m.mu + m.lambda) /
                           noise);
        }
        const double psi = kernels::reference::energy(m, particles[i].F, particles[i].Jp);
        energy_error.add(std::fabs(energy[i] - psi) / (psi + 1e-2 * m.mu) / noise);
        kernels::BlockSummary summary;
        table.mpm.summarise(materials.data(), columns.view(), {i, i + 1}, &summary);
        const double wave2 = kernels::reference::wave_speed2(m, particles[i].F, particles[i].Jp);
        wave_error.add(std::fabs(summary.wave2 - wave2) / wave2 / noise);
      }
      CHECK(stress_error.value() < 5e-6);
      CHECK(energy_error.value() < 1e-4);
      CHECK(wave_error.value() < 1e-5);
    });
  }
}

TEST_CASE(
    "stress of clay is the derivative of its energy, and no uniaxial wave is faster than its wave speed") {
  const auto m = clay_materials()[0];
  check_stress_is_the_derivative_of_energy(m, clay_particles(101, 141, 0.1, 1));
  check_no_wave_is_faster_than_its_bound(m);
}

TEST_CASE("yield of clay is the reference's, also for degenerate and inverted elements") {
  for (const double strain : {0.003, 0.03, 0.3, 1.5}) {
    INFO("strain " << strain);
    check_yield_is_the_references(clay_materials(), clay_particles(2053, 142, strain, 5),
                                  [](const double*) { return 1.0; });
  }
}

TEST_CASE("clay yields into the ellipse that it had and gains no energy; what only shears keeps its volume") {
  const auto materials = clay_materials();
  Worst outside, gain, volume;
  int sheared = 0;
  for (const double strain : {0.003, 0.03, 0.3}) {
    for (auto p : reference_particles(clay_particles(4001, 143, strain, 4))) {
      const auto& m = materials[p.object];
      double u[9], s[3], v[9];
      kernels::reference::svd(p.F, u, s, v);
      if (s[2] < 0.1) continue;
      const double before = kernels::reference::energy(m, p.F, p.Jp), j = s[0] * s[1] * s[2], jp = p.Jp;
      if (!kernels::reference::project(m, p.F, p.Jp)) continue;
      outside.add(outside_ellipse(m, p.F, jp));
      gain.add((kernels::reference::energy(m, p.F, p.Jp) - before) / m.mu);
      kernels::reference::svd(p.F, u, s, v);
      if (s[0] - s[2] < 1e-9) continue;  // a tip
      ++sheared;
      volume.add(std::fabs(kernels::reference::determinant(p.F) / j - 1));
    }
  }
  CHECK(sheared > 100);
  CHECK(outside.value() < 1e-12);
  CHECK(gain.value() < 1e-12);
  CHECK(volume.value() < 1e-12);
}

TEST_CASE(
    "asking first whether clay yields gives the bits of decomposing everything, the same on v3 and v4") {
  const auto materials = clay_materials();
  for (const double strain : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
    const ParticleColumns original = random_particles(10007, 144, strain, 5);
    Random random(145);
    for (std::size_t i = 0; i < original.size(); ++i) {
      const auto press = static_cast<float>(1 + random.in(-0.02, 0.005));
      for (auto* column : original.view().F) column[i] *= press;
      original.view().Jp[i] = static_cast<float>(random.in(0.97, 1.01));
    }
    break_some(original);
    const kernels::ParticleRange range{0, original.size()};
    ParticleColumns of_v3;
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << " strain " << strain);
      ParticleColumns skipping = copy_of(original);
      const ParticleColumns all = copy_of(original);
      const int changed = table.mpm.project(materials.data(), skipping.view(), range);
      CHECK(lane_parts_of(table).project_all(materials.data(), all.view(), range) == changed);
      CHECK(changed > 1000);
      int differences = 0, from_v3 = 0;
      const bool v4 = std::strcmp(table.isa, "x86-64-v4") == 0;
      for (std::size_t k = 0; k < kColumns; ++k) {
        differences += std::memcmp(skipping.column(k), all.column(k), range.end * sizeof(float)) != 0;
        if (v4) from_v3 += std::memcmp(skipping.column(k), of_v3.column(k), range.end * sizeof(float)) != 0;
      }
      CHECK(differences == 0);
      CHECK(from_v3 == 0);
      if (std::strcmp(table.isa, "x86-64-v3") == 0) of_v3 = std::move(skipping);
    });
  }
}

namespace {

struct Element {  // an even stretch
  double f[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, jp = 1;
  double pressure(const kernels::MaterialParams& m) const {
    double tau[9];
    kernels::reference::stress(m, f, jp, tau);
    return -(tau[0] + tau[4] + tau[8]) / 3;
  }
  // By the logarithmic strain `volume`, in small steps.
  void strain(const kernels::MaterialParams& m, double volume) {
    constexpr int kSteps = 4000;
    for (int n = 0; n < kSteps; ++n) {
      for (double& x : f) x *= std::exp(volume / 3 / kSteps);
      kernels::reference::project(m, f, jp);
    }
  }
};

}  // namespace

TEST_CASE(
    "a layer that collapses softens whether it is crushed or torn, closes without tension, and hardens") {
  const auto m = collapsing();
  const double kappa = kappa_of(m), p0 = kappa * std::sinh(0.02 * m.hardening);
  for (const double way : {-1.0, 1.0}) {
    INFO((way < 0 ? "crushed" : "torn"));
    const double elastic = 0.5 * std::log(1 - (way < 0 ? 2 : -2 * m.beta) * p0 / kappa);
    Element layer;
    layer.strain(m, 0.999 * elastic);
    CHECK(layer.jp == 1);
    double bearing = std::fabs(layer.pressure(m));
    CHECK(bearing == Approx(way < 0 ? p0 : m.beta * p0).epsilon(0.01));
    while (layer.jp > 0) {  // p0 and with it the elastic strain fall, alpha counts what is plastic
      layer.strain(m, 0.002 * way);
      CHECK(std::fabs(layer.pressure(m)) < bearing);
      bearing = std::fabs(layer.pressure(m));
    }
    CHECK(bearing <= 1.1e-5 * kappa);
    layer.strain(m, 0.01);
    CHECK(layer.pressure(m) == Approx(0).margin(1e-6 * kappa));
  }
  Element layer;
  layer.jp = -1;
  layer.strain(m, -0.9 * m.collapse);
  CHECK(layer.pressure(m) <= 1.1e-5 * kappa);
  layer.strain(m, -0.1 * m.collapse - 0.02);  // the rest, and 0.02 of plastic and elastic strain together
  const double packed = -std::log(-layer.jp) - m.collapse;
  CHECK(layer.pressure(m) == Approx(kappa * (1e-5 + std::sinh(m.hardening * packed))).epsilon(1e-3));
  CHECK(packed > 0.005);
  CHECK(layer.pressure(m) > 0.005 * kappa);
}

}  // namespace firn::test::cam_clay
