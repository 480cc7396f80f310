// SPDX-License-Identifier: MIT
// The oracle of the kernel tests by itself: in double, the transfers keep what MLS-MPM keeps exactly (Hu et
// al. 2018; Jiang et al. 2015 for the angular momentum with the affine part) down to round-off.
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "kernels/reference/mpm.h"
#include "src/core/vector.h"
#include "tests/catch.h"
#include "tests/kernels/particles.h"

namespace firn::test::reference {
namespace ref = firn::kernels::reference;

namespace {

constexpr double kDx = 1. / 128;  // m; the same number in float

struct Kept {
  double mass = 0;
  Vec3 momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
};

Kept kept_by(const std::vector<ref::Particle>& body) {
  Kept sum;
  for (const ref::Particle& p : body) {
    const Vec3 x = Vec3(p.x[0], p.x[1], p.x[2]) * kDx, v(p.v[0], p.v[1], p.v[2]);
    const double b = p.m * kDx * kDx / 4;  // sum w m v_i (x_i - x_p)^T = b C
    sum.mass += p.m;
    sum.momentum += p.m * v;
    sum.angular_momentum += p.m * x.cross(v) + b * Vec3(p.C[7] - p.C[5], p.C[2] - p.C[6], p.C[3] - p.C[1]);
  }
  return sum;
}

// A ball of 1.5 cells around the middle of the block, spinning, drifting and stirred, so that it rings.
std::vector<ref::Particle> stirred_ball(double mass) {
  std::vector<ref::Particle> body;
  const Vec3 center(2, 2, 2), omega(3, -8, 5);
  for (int i = 0; i < 16 * 16 * 16; ++i) {
    const Vec3 x = Vec3(i / 256 + 0.5, i / 16 % 16 + 0.5, i % 16 + 0.5) / 4;
    if ((x - center).norm() > 1.5) continue;
    const Vec3 v = omega.cross(x - center) * kDx + Vec3(0.02 + 0.05 * std::sin(3 * x.y()), 0.01, -0.02);
    body.push_back(
        {{x.x(), x.y(), x.z()}, {v.x(), v.y(), v.z()}, {}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1, mass, 0});
  }
  return body;
}

}  // namespace

TEST_CASE("in double, a free body keeps mass and momentum to 1e-13, angular momentum to 1e-12", "[kernels]") {
  for (const kernels::MaterialParams& material : test::test_materials()) {
    std::vector<ref::Particle> body = stirred_ball(kDx * kDx * kDx / 64 / material.inverse_density);
    const kernels::StepParams step{1e-4f, float(kDx), float(1 / kDx), {0, 0, 0}, 0, 0};
    const Kept before = kept_by(body);
    std::vector<double> tile(kernels::kTileFloats);
    double strained = 0;
    for (int n = 0; n < 1000; ++n) {
      ref::p2g(step, &material, body.data(), static_cast<int>(body.size()), tile.data());
      for (int part = 0; part < kernels::kTileFloats; part += 4 * kernels::kBlockNodes)
        ref::grid_update(step, nullptr, 0, 0, tile.data() + part, nullptr);
      ref::g2p(step, &material, body.data(), static_cast<int>(body.size()), tile.data());
      for (const ref::Particle& p : body) strained = std::max(strained, std::abs(p.F[0] - 1));
    }
    const Kept after = kept_by(body);
    const double momentum = (after.momentum - before.momentum).norm() / before.momentum.norm();
    const double angular =
        (after.angular_momentum - before.angular_momentum).norm() / before.angular_momentum.norm();
    INFO("momentum " << momentum << ", angular momentum " << angular << ", strain " << strained);
    CHECK(after.mass == before.mass);
    CHECK(momentum < 1e-13);
    CHECK(angular < 1e-12);
    CHECK(strained > 1e-3);
    for (const ref::Particle& p : body) {
      for (const double x : p.x) REQUIRE((x >= 0 && x < 4));  // the tile holds the stencil of every one
    }
  }
}

}  // namespace firn::test::reference
