// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstring>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/particles.h"

namespace firn::test::transfer {
namespace {

struct alignas(64) Tile {
  float nodes[kernels::kTileStride];
};

constexpr std::size_t kCounts[] = {1,  2,  3,  4,  5,  6,  7,  8,  9,   10, 11,
                                   12, 13, 14, 15, 16, 17, 31, 64, 301, 517};

Tile random_velocities(std::uint64_t seed) {
  Tile tile;
  Random random(seed);
  for (float& x : tile.nodes) x = static_cast<float>(random.in(-2, 2));
  return tile;
}

}  // namespace

TEST_CASE("P2G is the reference's for any number of particles, mixed objects and places in the margin") {
  const auto step = test_step();
  const auto materials = test_materials();
  for (const std::size_t count : kCounts) {
    const ParticleColumns columns = random_particles(count, 31 + count, 0.05, 3);
    const auto particles = reference_particles(columns);
    std::vector<double> expected(kernels::kTileFloats);
    kernels::reference::p2g(step, materials.data(), particles.data(), static_cast<int>(count),
                            expected.data());
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << ", " << count << " particles");
      Tile tile;
      table.mpm.p2g(step, materials.data(), columns.view(), {0, count}, tile.nodes);
      double scale[4] = {0, 0, 0, 0};
      for (int i = 0; i < kernels::kTileFloats; ++i)
        scale[i % 4] = std::max(scale[i % 4], std::fabs(expected[i]));
      Worst error;
      for (int i = 0; i < kernels::kTileFloats; ++i)
        error.add(std::fabs(tile.nodes[i] - expected[i]) / scale[i % 4]);
      CHECK(error.value() < 1e-5);
    });
  }
}

TEST_CASE("P2G conserves mass and momentum") {
  const auto step = test_step();
  const auto materials = test_materials();
  const ParticleColumns columns = random_particles(509, 32, 0.05, 3);
  double mass = 0, momentum[3] = {0, 0, 0}, speed = 0;
  const kernels::ParticleView p = columns.view();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    mass += p.m[i];
    for (int axis = 0; axis < 3; ++axis) {
      momentum[axis] += double(p.m[i]) * p.v[axis][i];
      speed += double(p.m[i]) * std::fabs(p.v[axis][i]);
    }
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    Tile tile;
    table.mpm.p2g(step, materials.data(), columns.view(), {0, columns.size()}, tile.nodes);
    double sum[4] = {0, 0, 0, 0};
    for (int i = 0; i < kernels::kTileFloats; ++i) sum[i % 4] += tile.nodes[i];
    CHECK(std::fabs(sum[3] - mass) < 1e-6 * mass);
    for (int axis = 0; axis < 3; ++axis) CHECK(std::fabs(sum[axis] - momentum[axis]) < 1e-5 * speed);
  });
}

TEST_CASE("G2P is the reference's for any number of particles, mixed objects and places in the margin") {
  const auto step = test_step();
  const auto materials = test_materials();
  const Tile tile = random_velocities(33);
  const std::vector<double> velocities(tile.nodes, tile.nodes + kernels::kTileFloats);
  for (const std::size_t count : kCounts) {
    const ParticleColumns original = random_particles(count, 34 + count, 0.03, 3);
    auto expected = reference_particles(original);
    kernels::reference::g2p(step, materials.data(), expected.data(), static_cast<int>(count),
                            velocities.data());
    on_every_isa([&](const kernels::KernelTable& table) {
      INFO(table.isa << ", " << count << " particles");
      const ParticleColumns columns = copy_of(original);
      kernels::BlockSummary summary;
      table.mpm.g2p(step, materials.data(), columns.view(), {0, count}, tile.nodes, &summary);
      const auto got = reference_particles(columns);
      Worst x, v, c, f, jp;
      double speed2 = 0, rate2 = 0;
      for (std::size_t i = 0; i < count; ++i) {
        double v2 = 0, c2 = 0;
        for (int axis = 0; axis < 3; ++axis) {
          x.add(std::fabs(got[i].x[axis] - expected[i].x[axis]));
          v.add(std::fabs(got[i].v[axis] - expected[i].v[axis]));
          v2 += expected[i].v[axis] * expected[i].v[axis];
        }
        for (int k = 0; k < 9; ++k) {
          c.add(std::fabs(got[i].C[k] - expected[i].C[k]) / 400);
          f.add(std::fabs(got[i].F[k] - expected[i].F[k]));
          c2 += expected[i].C[k] * expected[i].C[k];
        }
        jp.add(std::fabs(got[i].Jp - expected[i].Jp));
        speed2 = std::max(speed2, v2);
        rate2 = std::max(rate2, c2);
      }
      CHECK(x.value() < 1e-7);
      CHECK(v.value() < 2e-6);
      CHECK(c.value() < 5e-6);
      CHECK(f.value() < 2e-5);
      CHECK(jp.value() < 2e-5);
      CHECK(summary.speed2 == Approx(speed2).epsilon(1e-4));
      CHECK(summary.rate2 == Approx(rate2).epsilon(1e-4));
      CHECK(summary.not_finite == 0);
    });
  }
}

TEST_CASE("G2P gives back an affine velocity field exactly, whatever the particle's place") {
  const auto step = test_step();
  const auto materials = test_materials();
  const double a[9] = {3, -20, 7, 11, 5, -9, 2, 4, -8};  // 1/s
  Tile tile{};
  for (int n = 0; n < 512; ++n) {
    const int node[3] = {n / 64 - 1, n / 8 % 8 - 1, n % 8 - 1};
    const double d[3] = {node[0] - 0.5, node[1] - 0.5, node[2] - 0.5};  // cells from the block's corner
    for (int r = 0; r < 3; ++r) {
      tile.nodes[4 * n + r] =
          static_cast<float>(0.01 * (a[3 * r] * d[0] + a[3 * r + 1] * d[1] + a[3 * r + 2] * d[2]) + r);
    }
  }
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    const ParticleColumns columns = random_particles(301, 35, 0.0, 1);
    kernels::BlockSummary summary;
    table.mpm.g2p(step, materials.data(), columns.view(), {0, columns.size()}, tile.nodes, &summary);
    Worst error;
    for (const auto& p : reference_particles(columns)) {
      for (int k = 0; k < 9; ++k) error.add(std::fabs(p.C[k] - a[k]));
    }
    CHECK(error.value() < 1e-3);
  });
}

TEST_CASE("G2P flags particles that leave the margin and values that are not numbers") {
  const auto materials = test_materials();
  const Tile tile = random_velocities(36);
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    for (const std::size_t index : {0, 18, 36}) {
      auto step = test_step();
      step.dt = 1e-6f;
      kernels::BlockSummary summary;
      const ParticleColumns columns = random_particles(37, 37, 0.01, 2);
      for (auto* x : columns.view().x) {
        for (std::size_t i = 0; i < 37; ++i) x[i] = 2 * kernels::kOneCell;
      }
      table.mpm.g2p(step, materials.data(), columns.view(), {0, 37}, tile.nodes, &summary);
      CHECK(summary.strayed == 0);
      CHECK(summary.not_finite == 0);
      columns.view().x[1][index] = -kernels::kOneCell;  // moves out or in by a thousandth of a cell
      step.dt = 1e-4f;
      table.mpm.g2p(step, materials.data(), columns.view(), {0, 37}, tile.nodes, &summary);
      CHECK(summary.strayed == (columns.view().x[1][index] < -kernels::kOneCell));
      columns.view().F[3][index] = NAN;
      table.mpm.g2p(step, materials.data(), columns.view(), {0, 37}, tile.nodes, &summary);
      CHECK(summary.not_finite == 1);
    }
  });
}

TEST_CASE("a particle's result does not depend on the range that it is processed in") {
  const auto step = test_step();
  const auto materials = test_materials();
  const Tile tile = random_velocities(38);
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    kernels::BlockSummary summary;
    const ParticleColumns whole = random_particles(100, 39, 0.03, 3),
                          parts = random_particles(100, 39, 0.03, 3);
    table.mpm.g2p(step, materials.data(), whole.view(), {0, 100}, tile.nodes, &summary);
    for (const auto& range : {kernels::ParticleRange{0, 7}, {7, 8}, {8, 41}, {41, 100}}) {
      table.mpm.g2p(step, materials.data(), parts.view(), range, tile.nodes, &summary);
    }
    int differences = 0;
    for (std::size_t k = 0; k < kColumns; ++k) {
      differences += std::memcmp(whole.column(k), parts.column(k), 100 * sizeof(float)) != 0;
    }
    CHECK(differences == 0);
  });
}

TEST_CASE("x86-64-v3 and x86-64-v4 give the same bits") {
  const auto tables = supported_kernels();
  if (tables.size() < 3) return;
  const auto step = test_step();
  const auto materials = test_materials();
  const Tile velocities = random_velocities(40);
  std::uint64_t hash[2] = {0, 0};
  for (int t = 0; t < 2; ++t) {
    const auto& mpm = tables[1 + t]->mpm;
    for (const double strain : {0.01, 0.05, 0.8}) {
      const ParticleColumns columns = random_particles(777, 41, strain, 3);
      Tile tile;
      kernels::BlockSummary summary;
      mpm.p2g(step, materials.data(), columns.view(), {0, columns.size()}, tile.nodes);
      mpm.g2p(step, materials.data(), columns.view(), {0, columns.size()}, velocities.nodes, &summary);
      for (const float x : tile.nodes) {
        std::uint32_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        hash[t] = hash_keys(hash[t], bits);
      }
      for (std::size_t k = 0; k < kColumns; ++k) {
        for (std::size_t i = 0; i < columns.size(); ++i) hash[t] = hash_keys(hash[t], columns.column(k)[i]);
      }
    }
  }
  CHECK(hash[0] == hash[1]);
}

TEST_CASE(
    "tiles reduce to the sum over all blocks that reach a node, and assemble gives the same nodes back") {
  // 3x3x3 blocks; every tile holds 1000 * its number + its node's place, so that a wrong node shows.
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    std::vector<Tile> tiles(27);
    double expected[kernels::kBlockFloats] = {};
    const float* around[27];
    for (int n = 0; n < 27; ++n) {
      around[n] = n == 5 ? nullptr : tiles[n].nodes;
      for (int i = 0; i < kernels::kTileStride; ++i)
        tiles[n].nodes[i] = static_cast<float>((1000 * n + 7 * i) % 4093);
      if (n == 5) continue;
      const int shift[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
      for (int t = 0; t < 512; ++t) {
        const int node[3] = {t / 64 - 1 + 4 * shift[0], t / 8 % 8 - 1 + 4 * shift[1],
                             t % 8 - 1 + 4 * shift[2]};
        bool inside = true;
        for (const int c : node) inside = inside && c >= 0 && c < 4;
        if (!inside) continue;
        for (int c = 0; c < 4; ++c)
          expected[4 * (16 * node[0] + 4 * node[1] + node[2]) + c] += tiles[n].nodes[4 * t + c];
      }
    }
    alignas(64) float nodes[kernels::kBlockFloats];
    table.mpm.reduce_tiles(around, nodes);
    Worst reduced;
    for (int i = 0; i < kernels::kBlockFloats; ++i) reduced.add(std::fabs(nodes[i] - expected[i]));
    CHECK(reduced.value() == 0);

    std::vector<float> blocks(27 * kernels::kBlockFloats);
    for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = static_cast<float>(i);
    for (int n = 0; n < 27; ++n) around[n] = &blocks[n * kernels::kBlockFloats];
    Tile tile;
    table.mpm.assemble_tile(around, tile.nodes);
    Worst assembled;
    for (int t = 0; t < 512; ++t) {
      const int at[3] = {t / 64 + 3, t / 8 % 8 + 3,
                         t % 8 + 3};  // node, counted from the corner of the 3x3x3 blocks
      const int block = at[0] / 4 * 9 + at[1] / 4 * 3 + at[2] / 4,
                node = at[0] % 4 * 16 + at[1] % 4 * 4 + at[2] % 4;
      for (int c = 0; c < 4; ++c) {
        assembled.add(std::fabs(tile.nodes[4 * t + c] - around[block][4 * node + c]));
      }
    }
    CHECK(assembled.value() == 0);
  });
}

namespace {

kernels::ContactNodes random_contact(Random& random, kernels::ContactKind kind, float friction,
                                     float static_friction, bool moving) {
  kernels::ContactNodes c{};
  c.collider = moving ? 2 : 0;
  c.kind = kind;
  c.friction = friction;
  c.static_friction = static_friction;
  c.moving = moving;
  for (int n = 0; n < kernels::kBlockNodes; ++n) {
    c.distance[n] = static_cast<float>(random.in(-1, 1));
    double r[9];
    random_rotation(random, r);
    for (int axis = 0; axis < 3; ++axis) c.normal[axis][n] = static_cast<float>(r[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    c.velocity[axis] = static_cast<float>(random.in(-2, 2));
    c.turn[axis] = static_cast<float>(random.in(-0.5, 0.5));
  }
  return c;
}

// Momenta and masses of 64 nodes, some empty.
void fill_nodes(Random& random, float* nodes) {
  for (int n = 0; n < kernels::kBlockNodes; ++n) {
    nodes[4 * n + 3] = n % 5 == 0 ? 0.f : static_cast<float>(random.in(1e-6, 1e-4));
    for (int axis = 0; axis < 3; ++axis) {
      nodes[4 * n + axis] = nodes[4 * n + 3] * static_cast<float>(random.in(-3, 3));
    }
  }
}

constexpr std::uint64_t kCounted = 0xf0f0ffff0ff01234;  // of the nodes, for the impulses

void check_grid_update(const kernels::ContactNodes (&contacts)[2]) {
  const auto step = test_step();
  Random random(7);
  alignas(64) float original[kernels::kBlockFloats];
  fill_nodes(random, original);
  std::vector<double> expected(original, original + kernels::kBlockFloats);
  constexpr int kSums = 3 * kernels::kImpulseParts;
  double impulses[kSums] = {}, most = 0;
  kernels::reference::grid_update(step, contacts, 2, kCounted, expected.data(), impulses);
  for (const double i : impulses) most = std::max(most, std::fabs(i));
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    alignas(64) float nodes[kernels::kBlockFloats];
    std::memcpy(nodes, original, sizeof nodes);
    double given[kSums] = {};
    table.mpm.grid_update(step, contacts, 2, kCounted, nodes, given);
    Worst error, of_impulse;
    for (int i = 0; i < kernels::kBlockFloats; ++i) error.add(std::fabs(nodes[i] - expected[i]));
    for (int i = 0; i < kSums; ++i) of_impulse.add(std::fabs(given[i] - impulses[i]));
    CHECK(error.value() < 5e-6);
    CHECK(of_impulse.value() < 1e-6 * most);
  });
}

}  // namespace

TEST_CASE("grid update is the reference's for every kind of contact, standing and moving") {
  for (const auto kind : {kernels::kSticky, kernels::kSlip, kernels::kSeparating}) {
    for (const float friction : {0.f, 0.3f, 2.f}) {
      for (const float more : {0.f, 0.5f}) {
        for (const bool moving : {false, true}) {
          Random random(42);
          const kernels::ContactNodes contacts[2] = {
              random_contact(random, kind, friction, friction + more, moving),
              random_contact(random, kind, friction, friction + more, moving)};
          INFO("kind " << kind << " friction " << friction << " + " << more << " moving " << moving);
          check_grid_update(contacts);
        }
      }
    }
  }
}

TEST_CASE(
    "a node stands while static friction can hold it, and is slowed by the dynamic one when it slides") {
  kernels::StepParams step{};
  kernels::ContactNodes c{};
  c.kind = kernels::kSeparating;
  c.friction = 0.2f;
  c.static_friction = 0.6f;
  for (int n = 0; n < kernels::kBlockNodes; ++n) c.normal[1][n] = 1;
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    for (const float speed : {0.f, 0.3f, 0.59f, 0.61f, 2.f}) {  // the normal speed is 1
      alignas(64) float nodes[kernels::kBlockFloats];
      for (int n = 0; n < kernels::kBlockNodes; ++n) {
        const float node[4] = {0, -1, speed, 1};
        std::copy(node, node + 4, nodes + 4 * n);
      }
      double impulse[kernels::kImpulseParts] = {};
      table.mpm.grid_update(step, &c, 1, ~std::uint64_t{0}, nodes, impulse);
      CHECK(impulse[1] == kernels::kBlockNodes);        // each node had 1 kg m/s of it
      CHECK(impulse[5] == 1.5 * kernels::kBlockNodes);  // in the middle of the block, 1.5 cells along x
      for (int n = 0; n < kernels::kBlockNodes; ++n) {
        REQUIRE(nodes[4 * n + 1] == 0);
        REQUIRE(nodes[4 * n + 2] == Approx(speed <= 0.6f ? 0 : speed - 0.2f));
      }
    }
  });
}

}  // namespace firn::test::transfer
