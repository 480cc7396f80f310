// SPDX-License-Identifier: MIT
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "src/mpm/state.h"
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

using namespace firn;
using namespace firn::test;

namespace {
double env(const char* name, double otherwise) {
  const char* v = std::getenv(name);
  return v ? std::atof(v) : otherwise;
}
}  // namespace

TEST_CASE("saw explore", "[.saw]") {
  const double dx = env("DX", 0.05), tilt = env("TILT", 0) * M_PI / 180, length = env("L", 12);
  const double h = env("H", 0.5), d = env("D", 0.15), floor = 0.55 * dx;
  Material slab = elastic(MaterialModel::neo_hookean);
  if (env("DRY", 0) > 0) slab = find_preset("dry_slab").material;
  slab.density = 250;
  slab.young_modulus = env("E", 1e6);
  slab.poisson_ratio = env("NU", 0.2);
  Material weak = find_preset("weak_layer").material;
  weak.compressive_strength = env("P0", 4e3);
  weak.cohesion_ratio = env("BETA", 0.1);
  weak.hardening = env("XI", 1);
  weak.collapse = env("COLLAPSE", 0.05);
  weak.friction_angle = env("PHI", 27);
  weak.young_modulus = env("EW", 1e6);
  SimulationSetup setup;
  setup.dx = dx;
  setup.sleep = false;
  setup.gravity = Vec3::Zero();
  const auto layer = [&](double low, double thick, const Material& m) {
    PlacedSnow snow = fill(Vec3(0, 0, 0.5 * dx), Vec3(length, thick, 2.5 * dx), dx, 2, m);
    for (Vec3& x : snow.position) x.y() += low;
    setup.snow.push_back(snow);
  };
  layer(floor + d, h, slab);
  layer(floor, d, weak);
  setup.colliders.push_back(plane(Vec3(0, floor, 0), Vec3(0, 1, 0), Contact::sticky, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 0.5 * dx), Vec3(0, 0, 1), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 2.5 * dx), Vec3(0, 0, -1), Contact::slip, 0));
  Simulation::State s(best_kernels(), std::move(setup));
  s.budget.top = 100;
  place_particles(s);
  s.rebuild_grid();
  s.summarise();
  const double cs = elastic_moduli(slab).s_wave_speed;
  const double rise = env("RISE", 0.3), speed = env("SAW", 4);
  const auto size = static_cast<std::size_t>(length / dx);
  std::vector<double> broke(size, 0);
  std::vector<double> x0;
  const auto at = [&](std::size_t b, std::size_t i) {
    return (4 * s.blocks.coord[b].x + s.particles.view().x[0][i] / double(kernels::kOneCell)) * dx;
  };
  x0.resize(s.particles.size());
  for (std::size_t b = 0; b < s.blocks.size(); ++b)
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i) x0[s.particles.view().id[i]] = at(b, i);
  std::printf("particles %zu cs %.2f alpha0 %.4g\n", s.particles.size(), cs, initial_compaction(weak));
  int n = 0;
  double crit = 0, end = rise + env("T", 1.5), report = rise;
  while (s.time < end) {
    const double up = s.time < rise ? 0.5 * (1 - std::cos(M_PI * s.time / rise)) : 1;
    s.setup.gravity = 9.81 * up * Vec3(-std::sin(tilt), -std::cos(tilt), 0);
    s.step(0.9 * stable_limit(s).dt);
    const double cut = crit > 0 ? crit : std::max(0.0, speed * (s.time - rise));
    std::vector<int> of(size, 0), gone(size, 0);
    const auto p = s.particles.view();
    for (std::size_t i = 0; i < s.particles.size(); ++i) {
      if (p.object[i] != 1) continue;
      const double x = x0[p.id[i]];
      if (x < cut) p.Jp[i] = -std::abs(p.Jp[i] < 0 ? p.Jp[i] : 1.f);
      const std::size_t c = std::min(size - 1, static_cast<std::size_t>(x / dx));
      of[c]++;
      gone[c] += p.Jp[i] < 0;
    }
    int broken = 0;
    for (std::size_t c = 0; c < size; ++c) {
      if (2 * gone[c] >= of[c] && broke[c] == 0) broke[c] = s.time;
      broken += broke[c] > 0;
    }
    const std::size_t ahead = static_cast<std::size_t>(cut / dx) + 10;
    if (crit == 0 && s.time > rise && ahead < size && broke[ahead] > 0) {
      crit = cut + 1e-9;
      std::printf("critical %.2f m at %.3f\n", cut, s.time - rise);
    }
    if (s.time > report) {
      report += 0.05;
      double v = 0, sag = 0;
      for (std::size_t i = 0; i < s.particles.size(); ++i) if (p.object[i] == 0) v += p.v[0][i], sag += p.v[1][i];
      std::printf("t %.3f cut %.2f broken %d/%zu first %d v %.3f %.3f\n", s.time - rise, cut, broken, size, int(broke[0] > 0), v / s.particles.size(), sag / s.particles.size());
      if (broken == int(size)) break;
    }
    ++n;
  }
  std::printf("steps %d\n", n);
  for (std::size_t c = 10; c + 10 < size; c += 20)
    std::printf("x %.2f t %.4f c/cs %.3f\n", c * dx, broke[c] - rise, 20 * dx / (broke[c + 20 < size ? c + 20 : size - 1] - broke[c]) / cs);
}
