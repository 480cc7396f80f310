// SPDX-License-Identifier: MIT
// Only what yields is decomposed, and in G2P not in its place but collected from the whole block. Neither may
// change a bit.
#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/lane_parts.h"
#include "tests/kernels/particles.h"

namespace firn::test {

kernels::LaneParts lane_parts_of([[maybe_unused]] const kernels::KernelTable& table) {
#ifdef FIRN_HAS_V4
  if (std::strcmp(table.isa, "x86-64-v4") == 0) return kernels::isa_v4::lane_parts();
#endif
#ifdef FIRN_HAS_V3
  if (std::strcmp(table.isa, "x86-64-v3") == 0) return kernels::isa_v3::lane_parts();
#endif
  return kernels::isa_base::lane_parts();
}

}  // namespace firn::test

namespace firn::test::yielding {
namespace {

struct alignas(64) Tile {
  float nodes[kernels::kTileStride];
};

// Velocities that strain a particle by a thousandth in a step.
Tile slow_velocities() {
  Tile tile;
  Random random(61);
  for (float& x : tile.nodes) x = static_cast<float>(random.in(-0.01, 0.01));
  return tile;
}

// F = U diag(s) V^T with s in, on, and outside the yield surface of its material, often within round-off of
// it.
ParticleColumns particles_about_yield(const std::vector<kernels::MaterialParams>& materials,
                                      std::size_t count, std::uint64_t seed) {
  ParticleColumns columns = random_particles(count, seed, 0, 3);
  const kernels::ParticleView p = columns.view();
  Random random(seed + 1);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& m = materials[p.object[i]];
    double u[9], v[9], s[3];
    random_rotation(random, u);
    random_rotation(random, v);
    for (double& value : s) {
      const double off = std::pow(10, random.in(-8, -1)) * (random.in(0, 1) < 0.5 ? -1 : 1);
      const int where = static_cast<int>(random.in(0, 4));
      value = where == 0   ? m.sigma_min + off
              : where == 1 ? m.sigma_max + off
                           : random.in(m.sigma_min, m.sigma_max);
    }
    for (int k = 0; k < 9; ++k) {
      double f = 0;
      for (int c = 0; c < 3; ++c) f += u[3 * (k / 3) + c] * s[c] * v[3 * (k % 3) + c];
      p.F[k][i] = static_cast<float>(f);
    }
  }
  return columns;
}

int different_columns(const ParticleColumns& a, const ParticleColumns& b) {
  int differences = 0;
  for (std::size_t k = 0; k < kColumns; ++k) {
    differences += std::memcmp(a.column(k), b.column(k), a.size() * sizeof(float)) != 0;
  }
  return differences;
}

// `yielding` of `count` particles, anywhere among them, are stretched by a tenth, out of any yield surface.
ParticleColumns some_yield(std::size_t count, std::size_t yielding, std::uint32_t objects) {
  ParticleColumns columns = random_particles(count, 100 * count + yielding, 0.001, objects);
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i;
  Random random(yielding);
  for (std::size_t i = count; i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.in(0, static_cast<double>(i)))]);
  }
  for (std::size_t i = 0; i < yielding; ++i) {
    for (auto* column : columns.view().F) column[order[i]] *= 1.1f;
  }
  return columns;
}

// G2P against G2P without plasticity followed by the decomposition of every particle in its place.
void check_g2p(const kernels::KernelTable& table, const ParticleColumns& original, int expected_clamped) {
  const auto step = test_step();
  const auto plastic = test_materials();
  auto elastic = plastic;
  for (auto& m : elastic) m.plastic = 0;
  const Tile tile = slow_velocities();
  const kernels::ParticleRange all{0, original.size()};
  const ParticleColumns collected = copy_of(original), in_place = copy_of(original);
  kernels::BlockSummary summary, trial, left;
  table.mpm.g2p(step, plastic.data(), collected.view(), all, tile.nodes, &summary);
  table.mpm.g2p(step, elastic.data(), in_place.view(), all, tile.nodes, &trial);
  const int clamped = lane_parts_of(table).project_all(plastic.data(), in_place.view(), all);
  CHECK(different_columns(collected, in_place) == 0);
  CHECK(summary.clamped == clamped);
  CHECK(summary.clamped == expected_clamped);
  table.mpm.summarise(plastic.data(), collected.view(), all, &left);
  CHECK(summary.speed2 == left.speed2);
  CHECK(summary.rate2 == left.rate2);
  CHECK(summary.wave2 == left.wave2);
}

// J per m^3 of placed volume: tau : (trial - F) F^-1 less what hardening adds, in double.
double reference_work(const kernels::MaterialParams& m, const kernels::reference::Particle& trial,
                      const kernels::reference::Particle& after) {
  double tau[9], work = 0;
  kernels::reference::stress(m, after.F, trial.Jp, tau);
  const double j = kernels::reference::determinant(after.F);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) {  // column c of F^-1, by Cramer's rule
        double replaced[9];
        std::copy(after.F, after.F + 9, replaced);
        for (int i = 0; i < 3; ++i) replaced[3 * i + k] = i == c;
        const double inverse = kernels::reference::determinant(replaced) / j;
        work += tau[3 * r + c] * (trial.F[3 * r + k] - after.F[3 * r + k]) * inverse;
      }
    }
  }
  return work + kernels::reference::energy(m, after.F, trial.Jp) -
         kernels::reference::energy(m, after.F, after.Jp);
}

}  // namespace

TEST_CASE("plastic work is the stress times the plastic strain, the same count on v3 and v4") {
  const auto step = test_step();
  const auto plastic = test_materials();
  auto elastic = plastic;
  for (auto& m : elastic) m.plastic = 0;
  const Tile tile = slow_velocities();
  for (const std::size_t yielding : {0, 1, 9, 100}) {
    const ParticleColumns original = some_yield(203, yielding, 3);
    std::vector<std::int64_t> counts;
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << ", " << yielding << " yield");
      const ParticleColumns after = copy_of(original), trial = copy_of(original);
      kernels::BlockSummary summary, ignored;
      table.mpm.g2p(step, plastic.data(), after.view(), {0, 203}, tile.nodes, &summary);
      table.mpm.g2p(step, elastic.data(), trial.view(), {0, 203}, tile.nodes, &ignored);
      CHECK(ignored.plastic_work == 0);
      const auto ended = reference_particles(after), tried = reference_particles(trial);
      double expected = 0;
      for (std::size_t i = 0; i < ended.size(); ++i) {
        const auto& m = plastic[static_cast<std::size_t>(ended[i].object)];
        expected += ended[i].m * m.inverse_density * reference_work(m, tried[i], ended[i]);
      }
      CHECK(static_cast<double>(summary.plastic_work) / step.work_quanta ==
            Approx(expected).epsilon(1e-4).margin(1e-18));
      if (std::string(table.isa) != "base") counts.push_back(summary.plastic_work);
    });
    for (const std::int64_t count : counts) CHECK(count == counts.front());
    if (yielding > 10 && !counts.empty()) CHECK(counts.front() > 1000000);
  }
}

TEST_CASE("the wave speed of snow softer than at rest is its own, not that of the lanes beside it") {
  const auto step = test_step();
  const auto materials = test_materials();
  const Tile tile = slow_velocities();
  on_every_isa([&](const kernels::KernelTable& table) {
    for (const std::size_t count : {1, 8, 15, 16, 17}) {
      INFO(table.isa << ", " << count << " particles");
      const ParticleColumns columns = random_particles(count, 80, 0.0005, 1);
      for (std::size_t i = 0; i < count; ++i) columns.view().Jp[i] = 1.2f;
      kernels::BlockSummary summary;
      table.mpm.g2p(step, materials.data(), columns.view(), {0, count}, tile.nodes, &summary);
      double wave2 = 0;
      for (const auto& p : reference_particles(columns)) {
        wave2 = std::max(wave2, kernels::reference::wave_speed2(materials[0], p.F, p.Jp));
      }
      CHECK(summary.wave2 == Approx(wave2).epsilon(1e-5));
    }
  });
}

TEST_CASE("decomposing only what yields gives the bits of decomposing everything") {
  auto materials = test_materials();
  materials[2].plastic = 1;
  materials[2].sigma_min = 0.6f;  // far enough from a rotation for the SVD
  materials[2].sigma_max = 1.5f;
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    for (int round = 0; round < 10; ++round) {
      const ParticleColumns original = particles_about_yield(materials, 20011, 70 + 2 * round);
      const ParticleColumns skipping = copy_of(original), all = copy_of(original);
      const int clamped = table.mpm.project(materials.data(), skipping.view(), {0, original.size()});
      CHECK(lane_parts_of(table).project_all(materials.data(), all.view(), {0, original.size()}) == clamped);
      CHECK(different_columns(skipping, all) == 0);
      CHECK(clamped > 1000);
    }
  });
}

TEST_CASE("G2P projects any number of yielding particles as if each were projected in its place") {
  on_every_isa([&](const kernels::KernelTable& table) {
    for (const std::size_t count : {1, 15, 16, 17, 64, 203}) {
      for (const std::size_t yielding :
           {std::size_t{0}, std::size_t{1}, std::size_t{15}, std::size_t{16}, std::size_t{17}, count}) {
        if (yielding > count) continue;
        INFO(table.isa << ", " << yielding << " of " << count);
        check_g2p(table, some_yield(count, yielding, 1), static_cast<int>(yielding));
      }
    }
  });
}

TEST_CASE("G2P projects yielding particles of mixed materials, some of them elastic, as if each were alone") {
  on_every_isa([&](const kernels::KernelTable& table) {
    for (const std::size_t count : {2, 17, 64, 203}) {
      for (const std::size_t yielding : {std::size_t{1}, count / 2, count}) {
        INFO(table.isa << ", " << yielding << " of " << count);
        const ParticleColumns original = some_yield(count, yielding, 3);
        int clamped = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const kernels::ParticleView p = original.view();
          double f[9];
          for (int k = 0; k < 9; ++k) f[k] = p.F[k][i];
          clamped += p.object[i] != 2 && kernels::reference::determinant(f) > 1.2;
        }
        check_g2p(table, original, clamped);
      }
    }
  });
}

}  // namespace firn::test::yielding
