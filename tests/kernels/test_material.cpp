// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/material_laws.h"
#include "tests/kernels/particles.h"

namespace firn::test::material {
namespace {

constexpr int kSymmetric[6] = {0, 4, 8, 1, 2, 5};  // xx yy zz xy xz yz in a row-major 3x3

// Largest error of the stress relative to (2 mu + lambda) h, the scale of round-off in F.
double stress_error(const kernels::KernelTable& table, const ParticleColumns& columns) {
  const auto materials = test_materials();
  const auto particles = reference_particles(columns);
  std::vector<float> tau(6 * columns.size());
  table.mpm.stress(materials.data(), columns.view(), {0, columns.size()}, tau.data(), columns.size());
  Worst error;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const auto& m = materials[particles[i].object];
    double expected[9], largest = 0;
    kernels::reference::stress(m, particles[i].F, particles[i].Jp, expected);
    for (const double t : expected) largest = std::max(largest, std::fabs(t));
    const double scale = (2 * m.mu + m.lambda) * std::exp(m.hardening * (1 - particles[i].Jp)) + largest;
    for (int k = 0; k < 6; ++k) {
      error.add(std::fabs(tau[k * columns.size() + i] - expected[kSymmetric[k]]) / scale);
    }
  }
  return error.value();
}

}  // namespace

TEST_CASE("stress of nearly rigid snow is the reference's") {
  on_every_isa([](const kernels::KernelTable& table) {
    INFO(table.isa);
    CHECK(stress_error(table, random_particles(4099, 21, 0.02, 3)) < 2e-6);
  });
}

TEST_CASE("stress of strongly strained and inverted elements is the reference's") {
  on_every_isa([](const kernels::KernelTable& table) {
    INFO(table.isa);
    CHECK(stress_error(table, random_particles(4099, 22, 0.6, 3)) < 1e-5);
  });
}

TEST_CASE("elastic energy is the reference's") {
  const auto materials = test_materials();
  for (const double strain : {0.03, 0.3}) {
    const ParticleColumns columns = random_particles(1031, 23, strain, 3);
    const auto particles = reference_particles(columns);
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << " strain " << strain);
      std::vector<float> energy(columns.size());
      table.mpm.elastic_energy(materials.data(), columns.view(), {0, columns.size()}, energy.data());
      Worst error;
      for (std::size_t i = 0; i < particles.size(); ++i) {
        const auto& m = materials[particles[i].object];
        const double expected = kernels::reference::energy(m, particles[i].F, particles[i].Jp);
        const double scale = m.mu * std::exp(m.hardening * (1 - particles[i].Jp));
        error.add(std::fabs(energy[i] - expected) / (expected + 1e-2 * scale));
      }
      CHECK(error.value() < 1e-4);
    });
  }
}

TEST_CASE("plasticity is the reference's, also for degenerate and inverted elements") {
  for (const double strain : {0.005, 0.03, 0.3, 1.5}) {
    INFO("strain " << strain);
    check_yield_is_the_references(test_materials(), random_particles(2053, 24, strain, 2),
                                  [](const double*) { return 1.0; });
  }
}

TEST_CASE("an element inside the yield surface keeps every bit of F and Jp, whatever stands beside it") {
  const auto materials = test_materials();
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    const ParticleColumns calm = random_particles(1009, 25, 0.001, 1),
                          mixed = random_particles(1009, 25, 0.001, 1);
    for (std::size_t i = 0; i < mixed.size(); i += 3) mixed.view().F[4][i] += 0.2f;  // a violent neighbour
    const ParticleColumns before = random_particles(1009, 25, 0.001, 1);
    CHECK(table.mpm.project(materials.data(), calm.view(), {0, calm.size()}) == 0);
    CHECK(table.mpm.project(materials.data(), mixed.view(), {0, mixed.size()}) == 337);
    int differences = 0;
    for (std::size_t k = 0; k < kColumns; ++k) {
      for (std::size_t i = 0; i < mixed.size(); ++i) {
        differences += calm.column(k)[i] != before.column(k)[i];
        if (i % 3 != 0) differences += mixed.column(k)[i] != before.column(k)[i];
      }
    }
    CHECK(differences == 0);
  });
}

TEST_CASE(
    "a clamped element lies on the yield surface and projecting it again changes it by round-off only") {
  const auto materials = test_materials();
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    const ParticleColumns columns = random_particles(1009, 26, 0.3, 2);
    table.mpm.project(materials.data(), columns.view(), {0, columns.size()});
    Worst outside;
    for (const auto& p : reference_particles(columns)) {
      double u[9], s[3], v[9];
      kernels::reference::svd(p.F, u, s, v);
      const auto& m = materials[p.object];
      for (const double sigma : s) outside.add(std::max(m.sigma_min - sigma, sigma - m.sigma_max));
    }
    CHECK(outside.value() < 2e-6);
  });
}

TEST_CASE(
    "stress, energy and plasticity of 1 to 17 particles of a column are those of the whole column, and no "
    "more") {
  const auto materials = test_materials();
  constexpr std::size_t kAll = 40;
  constexpr float kUntouched = -7;
  const ParticleColumns original = random_particles(kAll, 27, 0.1, 3);
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    const kernels::MpmKernels& mpm = table.mpm;
    std::vector<float> tau(6 * kAll), energy(kAll);
    mpm.stress(materials.data(), original.view(), {0, kAll}, tau.data(), kAll);
    mpm.elastic_energy(materials.data(), original.view(), {0, kAll}, energy.data());
    const ParticleColumns projected = copy_of(original);
    mpm.project(materials.data(), projected.view(), {0, kAll});
    int differences = 0;
    for (std::size_t count = 1; count <= 17; ++count) {
      const std::size_t begin = count % 5, end = begin + count;
      std::vector<float> part_tau(6 * kAll, kUntouched), part_energy(kAll, kUntouched);
      mpm.stress(materials.data(), original.view(), {begin, end}, part_tau.data(), kAll);
      mpm.elastic_energy(materials.data(), original.view(), {begin, end}, part_energy.data());
      const ParticleColumns part = copy_of(original);
      mpm.project(materials.data(), part.view(), {begin, end});
      for (std::size_t i = 0; i < kAll; ++i) {
        const bool inside = i >= begin && i < end;
        for (int k = 0; k < 6 && i + begin < kAll; ++k) {
          const float own = i < count ? tau[k * kAll + begin + i] : kUntouched;
          differences += part_tau[k * kAll + i] != own;
        }
        if (i + begin < kAll) differences += part_energy[i] != (i < count ? energy[begin + i] : kUntouched);
        for (std::size_t k = 0; k < kColumns; ++k) {
          differences += part.column(k)[i] != (inside ? projected : original).column(k)[i];
        }
      }
    }
    CHECK(differences == 0);
  });
}

TEST_CASE("the summary of 1 to 17 particles has their largest speed, rate and wave speed, as the reference") {
  const auto materials = test_materials();
  const ParticleColumns columns = random_particles(40, 28, 0.1, 3);
  const auto particles = reference_particles(columns);
  on_every_isa([&](const kernels::KernelTable& table) {
    for (std::size_t count = 1; count <= 17; ++count) {
      INFO(table.isa << ", " << count << " particles");
      const std::size_t begin = count % 5;
      double speed2 = 0, rate2 = 0, wave2 = 0;
      for (std::size_t i = begin; i < begin + count; ++i) {
        const auto& p = particles[i];
        double v2 = 0, c2 = 0;
        for (const double v : p.v) v2 += v * v;
        for (const double c : p.C) c2 += c * c;
        speed2 = std::max(speed2, v2);
        rate2 = std::max(rate2, c2);
        wave2 = std::max(wave2, kernels::reference::wave_speed2(materials[p.object], p.F, p.Jp));
      }
      kernels::BlockSummary summary;
      table.mpm.summarise(materials.data(), columns.view(), {begin, begin + count}, &summary);
      CHECK(summary.speed2 == Approx(speed2).epsilon(1e-5));
      CHECK(summary.rate2 == Approx(rate2).epsilon(1e-5));
      CHECK(summary.wave2 == Approx(wave2).epsilon(1e-5));
      CHECK(summary.not_finite == 0);
    }
  });
}

}  // namespace firn::test::material
