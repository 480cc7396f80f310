// SPDX-License-Identifier: MIT
#include "bench/trace_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/particles/sort.h"

namespace firn::bench {

namespace {

constexpr std::uint64_t kJitterSeed = 5;
constexpr double kJitter = 0.25;  // spacings, to each side
constexpr double kDx = 2;         // m: 8 particles a cell

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

// The lattice point, displaced at random.
Vec3 jittered(int x, int y, int z) {
  const auto displaced = [&](int at, int axis) {
    return at + kJitter * (2 * uniform_double(hash_keys(kJitterSeed, axis, x, y, z)) - 1);
  };
  return {displaced(x, 0), displaced(y, 1), displaced(z, 2)};
}

// The points of the lattice within [-half, half]^3 that `inside` takes, x fastest.
template <class Inside>
std::vector<Vec3> lattice(const Eigen::Vector3i& half, Inside&& inside) {
  std::vector<Vec3> points;
  for (int z = -half.z(); z <= half.z(); ++z) {
    for (int y = -half.y(); y <= half.y(); ++y) {
      for (int x = -half.x(); x <= half.x(); ++x) {
        if (inside(Vec3(x, y, z))) points.push_back(jittered(x, y, z));
      }
    }
  }
  return points;
}

// Height of the dunes in lengths of their footprint, at u, v in [-0.5, 0.5].
double dune_height(double u, double v) {
  return 0.05 + 0.015 * std::sin(14 * u) * std::cos(11 * v) + 0.008 * std::sin(37 * u + 2 * v) +
         std::max(0.0, 0.16 - 0.45 * std::hypot(u, v));
}

double mean_dune_height() {
  constexpr int kSide = 512;
  double sum = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    sum += dune_height((i % kSide + 0.5) / kSide - 0.5, (i / kSide + 0.5) / kSide - 0.5);
  }
  return sum / (kSide * kSide);
}

struct Stage {
  std::vector<Vec3> points;
  Vec3 center, camera;
  double half_width;
};

Stage ball(std::size_t particles) {
  const double radius = std::cbrt(3 * static_cast<double>(particles) / (4 * std::numbers::pi));
  const int half = static_cast<int>(radius);
  const double distance = 1.08 * radius / std::sin(radians(kViewAngle / 2));
  return {lattice({half, half, half}, [&](const Vec3& p) { return p.norm() <= radius; }), Vec3::Zero(),
          distance * Vec3(0.45, 0.35, 0.82).normalized(), radius};
}

// m, of the footprint of so many: a column of height h holds h + 1/2 of them in the mean.
double slab_length(std::size_t particles) {
  const double mean = mean_dune_height();
  double length = 0;
  for (int i = 0; i < 50; ++i) {
    length = std::cbrt(std::max(1.0, static_cast<double>(particles) - length * length / 2) / mean);
  }
  return length;
}

Stage slab(std::size_t particles) {
  const double length = slab_length(particles);
  const int half = static_cast<int>(length / 2);
  Stage stage{lattice({half, half, half},
                      [&](const Vec3& p) {
                        return p.y() >= 0 && p.y() < length * dune_height(p.x() / length, p.z() / length);
                      }),
              Vec3::Zero(), Vec3::Zero(), length / 2};
  Bounds box;
  for (const Vec3& p : stage.points) box.include(p);
  stage.center = box.center();
  stage.camera = stage.center + 1.45 * length * Vec3(0.35, 0.55, 0.76).normalized();
  return stage;
}

LatticePoint in_cells(const Vec3& p) {
  const auto fixed = [](double x) {
    return static_cast<std::int64_t>(std::floor(std::ldexp(x / kDx, kernels::kCellBits)));
  };
  return {fixed(p.x()), fixed(p.y()), fixed(p.z())};
}

std::vector<std::uint32_t> order_of(const std::string& name, const std::vector<Vec3>& points) {
  if (name == "blocks") {
    ParticleBlocks blocks;
    return place_in_blocks(
        points.size(), [&](std::size_t i) { return in_cells(points[i]); }, kDx, blocks);
  }
  if (name != "lattice") {
    throw Error(ErrorCode::usage, "--order", "'" + name + "' is neither blocks nor lattice");
  }
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  return order;
}

Snapshot snapshot_of(const std::vector<Vec3>& points, const std::vector<std::uint32_t>& order) {
  Snapshot s;
  s.dx = kDx;
  s.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      s.position[axis][i] = static_cast<float>(points[order[i]][axis]);
      s.velocity[axis][i] = 0;
    }
    s.density[i] = 300;
    s.volume0[i] = 1;
    s.id[i] = order[i];
    s.object[i] = 0;
  }
  return s;
}

}  // namespace

TraceScene trace_scene(const std::string& shape, const std::string& order, std::size_t particles) {
  if (shape != "ball" && shape != "slab") {
    throw Error(ErrorCode::usage, "--shape", "'" + shape + "' is neither ball nor slab");
  }
  const Stage stage = shape == "ball" ? ball(particles) : slab(particles);
  const Vec3 light = stage.center + 6 * stage.half_width * Vec3(-0.5, 0.8, 0.6).normalized();
  return {snapshot_of(stage.points, order_of(order, stage.points)), stage.camera, stage.center, light};
}

}  // namespace firn::bench
