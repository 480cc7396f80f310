// SPDX-License-Identifier: MIT
#include "tests/trace/ray_cases.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <sstream>

#include "src/core/rng.h"
#include "tests/points.h"

namespace firn::test {
namespace {

double uniform(std::uint64_t seed, std::uint64_t index, std::uint64_t which) {
  return uniform_double(hash_keys(seed, index, which));
}

Vec3 in_cube(std::uint64_t seed, std::uint64_t i, std::uint64_t which) {
  return 2 * Vec3(uniform(seed, i, which), uniform(seed, i, which + 1), uniform(seed, i, which + 2)) -
         Vec3::Ones();
}

Vec3 on_sphere(std::uint64_t seed, std::uint64_t i, std::uint64_t which) {
  for (std::uint64_t attempt = 0;; ++attempt) {
    const Vec3 p = in_cube(seed, i, which + 1000 * attempt);
    if (p.squaredNorm() < 1 && p.squaredNorm() > 1e-4) return p.normalized();
  }
}

struct OneRay {
  double o[3], d[3];
};
OneRay ray_at(const RayStream& rays, std::size_t i) {
  const Vec3 o = rays.origin(i).cast<double>(), d = rays.direction(i).cast<double>();
  return {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}};
}

kernels::reference::Meeting meet(const RenderGrid& grid, const OneRay& ray, std::size_t ball) {
  const Vec3 c = grid.center(static_cast<std::uint32_t>(ball)).cast<double>();
  const double center[3] = {c[0], c[1], c[2]};
  return kernels::reference::meet(ray.o, ray.d, center, grid.radius(static_cast<std::uint32_t>(ball)));
}

// Lateral error of float arithmetic on this ray: what moves the origin and the direction by an ulp.
double slack(const OneRay& ray, const RenderGrid& grid) {
  const double far = std::max({std::fabs(ray.o[0]), std::fabs(ray.o[1]), std::fabs(ray.o[2])});
  return 1e-6 * (grid.view().cell * grid.view().cells[0] + 0.05 * far) + 1e-6;
}

// Whether some ball is hit beyond doubt at a distance in (slack, before).
bool surely_hit(const RenderGrid& grid, std::size_t balls, const OneRay& ray, double before, double slack,
                std::size_t& which) {
  for (which = 0; which < balls; ++which) {
    const auto meeting = meet(grid, ray, which);
    const double grazing = 4 * slack * grid.radius(static_cast<std::uint32_t>(which));
    const double t_error = slack + slack * grid.radius(static_cast<std::uint32_t>(which)) /
                                       std::sqrt(std::max(meeting.depth2, 1e-12)) * 4;
    if (meeting.depth2 > grazing && meeting.t > t_error && meeting.t < before - t_error) return true;
  }
  return false;
}

// Whether some ball may be hit at a distance in (0, before), for all that rounding can do.
bool may_hit(const RenderGrid& grid, const OneRay& ray, double before, double slack) {
  for (std::size_t ball = 0; ball < grid.size(); ++ball) {
    const auto meeting = meet(grid, ray, ball);
    const double r = grid.radius(static_cast<std::uint32_t>(ball));
    const double t_error = slack + std::sqrt(4 * slack * r);
    if (meeting.depth2 > -4 * slack * r && meeting.t > -t_error && meeting.t < before + t_error) return true;
  }
  return false;
}

std::string complaint(const char* what, std::size_t ray, std::size_t ball, double t) {
  std::ostringstream text;
  text << "ray " << ray << " " << what << " ball " << ball << " at " << t;
  return text.str();
}

}  // namespace

void add_particle(Snapshot& snapshot, const Vec3& world, double spacing) {
  const Vec3 p = world - vec(snapshot.origin);
  const std::size_t i = snapshot.size();
  snapshot = resized(snapshot, i + 1);
  for (int a = 0; a < 3; ++a) snapshot.position[a][i] = static_cast<float>(p[a]);
  snapshot.density[i] = 300;
  snapshot.volume0[i] = static_cast<float>(spacing * spacing * spacing);
  snapshot.id[i] = static_cast<std::uint32_t>(i);
}

Snapshot cloud(std::size_t count, std::uint64_t seed, double uneven) {
  Points points(2);
  const double half = 0.5 * std::cbrt(static_cast<double>(count)) * 1.2;
  for (std::size_t i = 0; i < count; ++i) {
    const double spacing = 1 + (uneven - 1) * uniform(seed, i, 9);
    points.add(half * in_cube(seed, i, 0), spacing * spacing * spacing);
  }
  return points.snapshot();
}

Snapshot lattice_ball(double radius, const Vec3& center, double jitter) {
  Points points(2);
  const int n = static_cast<int>(std::ceil(radius));
  std::uint64_t count = 0;
  for (int x = -n; x <= n; ++x) {
    for (int y = -n; y <= n; ++y) {
      for (int z = -n; z <= n; ++z) {
        if (Vec3(x, y, z).norm() > radius) continue;
        Vec3 p = center + Vec3(x, y, z);
        for (int a = 0; a < 3; ++a)
          p[a] += jitter * (2 * uniform(5, count, static_cast<std::uint64_t>(a)) - 1);
        ++count;
        points.add(p, 1);
      }
    }
  }
  return points.snapshot();
}

RayStream make_rays(const RenderGrid& grid, RayKind kind, std::size_t count, std::uint64_t seed) {
  RayStream rays;
  const auto balls = std::uint64_t{grid.view().cell_start[grid.brick_of_slot().size() * 64]};
  const Vec3 center =
      0.5 * grid.view().cell * Vec3(grid.view().cells[0], grid.view().cells[1], grid.view().cells[2]);
  for (std::size_t i = 0; i < count; ++i) {
    const auto ball = static_cast<std::uint32_t>(hash_keys(seed, i, 77) % balls);
    const Vec3 c = grid.center(ball).cast<double>();
    const double r = grid.radius(ball);
    Vec3 d = on_sphere(seed, i, 20), o = c;
    switch (kind) {
      case RayKind::random:
        o = center + 2 * center.norm() * in_cube(seed, i, 10);
        d = (c + 1.5 * r * in_cube(seed, i, 30) - o).normalized();
        break;
      case RayKind::axis_parallel: {
        d = Vec3::Zero();
        d[i % 3] = i % 2 == 0 ? 1 : -1;
        if (i % 5 == 0) d[(i + 1) % 3] = 0.5;
        d.normalize();
        o = c + r * in_cube(seed, i, 10) - 2 * center.norm() * d;
        break;
      }
      case RayKind::grazing:
        o = c + r * (1 + 1e-5 * (uniform(seed, i, 50) - 0.5)) * d.unitOrthogonal() - 5 * center.norm() * d;
        break;
      case RayKind::inside:
        o = c + 0.9 * r * in_cube(seed, i, 10) / std::sqrt(3);
        break;
      case RayKind::on_surface:
        o = c + r * on_sphere(seed, i, 60);
        break;
      case RayKind::far_away:
        o = c + 1e4 * d;
        d = (c + 1.5 * r * in_cube(seed, i, 30) - o).normalized();
        break;
    }
    const bool short_reach = i % 7 == 3;
    rays.push(o.cast<float>(), d.cast<float>(),
              short_reach ? static_cast<float>(center.norm()) : std::numeric_limits<float>::infinity());
  }
  return rays;
}

std::string judge_closest(TraceFunction closest, const RenderGrid& grid, RayStream rays) {
  const RayStream asked = rays;
  closest(grid.view(), rays.view(), 0, rays.size());
  const std::size_t balls = grid.size();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const OneRay ray = ray_at(rays, i);
    const double error = slack(ray, grid);
    std::size_t which = 0;
    if (rays.hit(i) == kernels::kNoHit) {
      if (rays.t(i) != asked.t(i)) return complaint("missed but changed its reach near", i, 0, rays.t(i));
      if (surely_hit(grid, balls, ray, asked.t(i), error, which)) return complaint("missed", i, which, 0);
      continue;
    }
    if (rays.hit(i) >= balls) return complaint("names no", i, rays.hit(i), rays.t(i));
    const auto meeting = meet(grid, ray, rays.hit(i));
    const double r = grid.radius(rays.hit(i));
    if (meeting.depth2 < -4 * error * r) return complaint("cannot hit", i, rays.hit(i), rays.t(i));
    const double t_error = error + std::sqrt(4 * error * r);  // at worst: a grazing hit
    if (std::fabs(meeting.t - rays.t(i)) > t_error) return complaint("misplaced", i, rays.hit(i), rays.t(i));
    if (!(rays.t(i) > 0) || rays.t(i) > asked.t(i))
      return complaint("left its reach to", i, rays.hit(i), rays.t(i));
    if (surely_hit(grid, balls, ray, rays.t(i), error, which))
      return complaint("passed", i, which, rays.t(i));
  }
  return {};
}

std::string judge_occluded(TraceFunction occluded, const RenderGrid& grid, RayStream rays) {
  const RayStream asked = rays;
  occluded(grid.view(), rays.view(), 0, rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const OneRay ray = ray_at(rays, i);
    const double error = slack(ray, grid);
    std::size_t which = 0;
    if (rays.t(i) != asked.t(i)) return complaint("changed its reach near", i, 0, rays.t(i));
    if (rays.hit(i) == kernels::kNoHit) {
      if (surely_hit(grid, grid.size(), ray, asked.t(i), error, which))
        return complaint("missed", i, which, 0);
      continue;
    }
    if (rays.hit(i) != 0) return complaint("names", i, rays.hit(i), 0);
    if (!may_hit(grid, ray, asked.t(i), error)) return complaint("cannot be blocked by", i, 0, 0);
  }
  return {};
}

}  // namespace firn::test
