// SPDX-License-Identifier: MIT
// The smooth surface and the density of the snow: what they are against the particles, and the kernels that
// meet rays with the surface against a fine march in double.
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include "src/core/parallel.h"
#include "src/core/rng.h"
#include "src/render/snow/snow_field.h"
#include "tests/catch.h"
#include "tests/threads.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::surface {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

// A frame's grid and fields.
struct Scene {
  explicit Scene(Snapshot given, const kernels::TraceKernels& kernels = best_trace(), double density = 400)
      : snapshot(std::move(given)), grid(kernels), field(kernels) {
    SnowLook look;
    look.density = density;
    grid.build(snapshot, {look}, true);
    field.build(grid, snapshot, {look});
  }
  Snapshot snapshot;
  RenderGrid grid;
  SnowField field;
};

Vec3f render_place(const Scene& scene, const Vec3& world) {
  return (world - scene.grid.origin()).cast<float>();
}

// Parallel rays through a square around the origin, `across` of them each way.
RayStream rays_onto(const Scene& scene, const Vec3& direction, double half, int across) {
  RayStream rays;
  const Vec3 d = direction.normalized(), u = d.unitOrthogonal(), v = d.cross(u);
  for (int i = 0; i < across * across; ++i) {
    const double a = half * (2 * (i % across + 0.5) / across - 1),
                 b = half * (2 * (i / across + 0.5) / across - 1);
    rays.push(render_place(scene, a * u + b * v - 3 * half * d), d.cast<float>(), kInf);
  }
  return rays;
}

void meet(const Scene& scene, RayStream& rays, const kernels::TraceKernels& kernels = best_trace()) {
  kernels.surface_closest(scene.field.view(), scene.field.surface(), rays.view(), 0, rays.size());
}

// Where the ray enters one of the loose balls.
double first_ball(const Scene& scene, const RayStream& rays, std::size_t i) {
  const Vec3 o = rays.origin(i).cast<double>(), d = rays.direction(i).cast<double>();
  double first = std::numeric_limits<double>::infinity();
  for (std::uint32_t s = 0; s < scene.grid.size(); ++s) {
    if (scene.grid.radius(s) < 0) continue;
    const Vec3 c = scene.grid.center(s).cast<double>();
    const double at[3] = {o[0], o[1], o[2]}, along[3] = {d[0], d[1], d[2]}, center[3] = {c[0], c[1], c[2]};
    const auto meeting = kernels::reference::meet(at, along, center, scene.grid.radius(s));
    if (meeting.depth2 > 0 && meeting.t > 0) first = std::min(first, meeting.t);
  }
  return first;
}

// The first t at which the fill along the ray rises through the level, by small steps; infinite if none.
double march(const Scene& scene, const RayStream& rays, std::size_t i, double reach, double step) {
  const Vec3f o = rays.origin(i), d = rays.direction(i);
  bool outside = scene.field.fill(o) < scene.field.surface().level;
  for (double t = step; t < reach; t += step) {
    const bool out = scene.field.fill(o + static_cast<float>(t) * d) < scene.field.surface().level;
    if (outside && !out) return t;
    outside = out;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

TEST_CASE(
    "the surface of a ball at eight particles a cell has its normals to 3 degrees and its volume to 2 %") {
  for (const double radius : {20., 40.}) {
    const Scene scene(lattice_ball(radius));
    const double filled = std::cbrt(3 * static_cast<double>(scene.snapshot.size()) / (4 * M_PI));  // radius
    double error2 = 0, cubes = 0, hits = 0;
    for (const Vec3& direction : {Vec3(1, 0.3, 0.2), Vec3(-0.2, 1, 0.5), Vec3(-0.7, -0.5, -1)}) {
      RayStream rays = rays_onto(scene, direction, 0.9 * radius, 100);
      meet(scene, rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const double aside =
            (rays.origin(i) - render_place(scene, Vec3::Zero())).cross(rays.direction(i)).norm();
        if (rays.hit(i) == kernels::kNoHit) {
          REQUIRE(aside > 0.97 * radius);  // no holes
          continue;
        }
        if (rays.hit(i) != kernels::kSurfaceHit) continue;  // a jittered particle looks out
        const Vec3 from_center = (rays.at_hit(i) - render_place(scene, Vec3::Zero())).cast<double>();
        const Vec3 normal = scene.field.normal(rays.at_hit(i), Vec3f(0, 1, 0)).cast<double>();
        error2 += std::pow(std::acos(std::min(1., normal.dot(from_center.normalized()))), 2);
        cubes += std::pow(from_center.norm(), 3);
        ++hits;
      }
    }
    INFO("radius " << radius << ": normals " << std::sqrt(error2 / hits) * 180 / M_PI << " degrees, volume "
                   << cubes / hits / std::pow(filled, 3));
    CHECK(std::sqrt(error2 / hits) < 3 * M_PI / 180);
    CHECK(cubes / hits == Approx(std::pow(filled, 3)).epsilon(0.02));
  }
}

TEST_CASE("the density integrates to the mass of the particles, and the surface clips little of it") {
  const Scene ball(lattice_ball(62), best_trace(), 312.5), loose(cloud(500, 3, 3), best_trace(), 150);
  const auto mass = [](const Snapshot& s, double density) {
    double sum = 0;
    for (const float volume : s.volume0) sum += volume * density;
    return sum;
  };
  CHECK(ball.field.mass() == Approx(mass(ball.snapshot, 312.5)).epsilon(1e-6));
  CHECK(loose.field.mass() == Approx(mass(loose.snapshot, 150)).epsilon(1e-6));
  INFO("in the medium " << ball.field.medium_mass() / ball.field.mass());
  CHECK(ball.field.medium_mass() > 0.97 * ball.field.mass());
  CHECK(ball.field.medium_mass() <= ball.field.mass());
}

TEST_CASE("the mass that light meets is that of points inside the surface or a ball") {
  const double density = GENERATE(150., 400.);
  SnowLook look, heavy;
  look.density = density;
  heavy.density = 3 * density, heavy.extinction = 2 * look.extinction;
  for (const SnowShape shape : {SnowShape::smooth, SnowShape::spheres}) {
    Snapshot snapshot = cloud(400, 19, 1.5);
    for (int i = 0; i < 30; ++i)
      add_particle(snapshot, Vec3(3.1 * (i % 6) - 8, 7 + 2.9 * (i / 6), 0.3 * i), 1);
    for (std::size_t i = 0; i < snapshot.size(); i += 3) snapshot.object[i] = 1;
    RenderGrid grid(best_trace());
    SnowField field(best_trace());
    grid.build(snapshot, {look, heavy}, true);
    field.build(grid, snapshot, {look, heavy}, shape);
    const auto& view = grid.view();
    double loose = 0, room = 0;
    for (std::uint32_t s = 0; s < grid.size() && shape == SnowShape::smooth; ++s) {
      const std::uint32_t i = grid.snapshot_index(s);
      if (grid.radius(s) < 0) continue;
      loose += snapshot.volume0[i] * (snapshot.object[i] == 1 ? 3 : 1) * density;
      room += snapshot.volume0[i];
    }
    const Vec3f size = view.cell * Vec3f(static_cast<float>(view.cells[0]), static_cast<float>(view.cells[1]),
                                         static_cast<float>(view.cells[2]));
    constexpr std::uint64_t kAcross = 80;  // a point in each of so many parts each way
    double sum = 0;
    for (std::uint64_t k = 0; k < kAcross * kAcross * kAcross; ++k) {
      const std::uint64_t at[3] = {k / kAcross / kAcross, k / kAcross % kAcross, k % kAcross};
      Vec3f p;
      for (int a = 0; a < 3; ++a) {
        const double jitter = uniform_double(hash_keys(23, k, static_cast<std::uint64_t>(a)));
        p[a] = size[a] * static_cast<float>((static_cast<double>(at[a]) + jitter) / kAcross);
      }
      bool in_ball = false;
      for (std::uint32_t s = 0; s < grid.size() && !in_ball; ++s)
        in_ball = grid.radius(s) > 0 && (grid.center(s) - p).norm() <= grid.radius(s);
      const bool within = shape == SnowShape::smooth ? field.fill(p) >= field.surface().level : in_ball;
      double here = within ? field.density(p) : 0.;
      if (in_ball && shape == SnowShape::smooth) here = std::max(here, loose / room);
      sum += here;
    }
    const double mass = sum * size.cast<double>().prod() / (kAcross * kAcross * kAcross);
    INFO("loose " << room << " of " << snapshot.size() << ", in the medium "
                  << field.medium_mass() / field.mass());
    CHECK(room > (shape == SnowShape::smooth ? 20 : -1));
    CHECK(field.medium_mass() == Approx(mass).epsilon(5e-3));
  }
}

TEST_CASE("no density in a cell is above its majorant, and snow of two densities has both") {
  Snapshot snapshot = lattice_ball(8);
  for (std::size_t i = 0; i < snapshot.size(); ++i) snapshot.object[i] = snapshot.position[0][i] > 0;
  SnowLook light, heavy;
  light.density = 100;
  heavy.density = 500;
  RenderGrid grid(best_trace());
  SnowField field(best_trace());
  grid.build(snapshot, {light, heavy}, true);
  field.build(grid, snapshot, {light, heavy});
  const auto at = [&](const Vec3& world) { return Vec3f((world - grid.origin()).cast<float>()); };
  CHECK(field.density(at(Vec3(-4, 0, 0))) == Approx(100).epsilon(0.1));
  CHECK(field.density(at(Vec3(4, 0, 0))) == Approx(500).epsilon(0.1));
  CHECK(field.fill(at(Vec3(-4, 0, 0))) == Approx(1).epsilon(0.1));
  CHECK(field.fill(at(Vec3(4, 0, 0))) == Approx(1).epsilon(0.1));
  CHECK(field.density(at(Vec3(20, 0, 0))) == 0);
  for (std::uint64_t k = 0; k < 20000; ++k) {
    Vec3f p;
    for (int a = 0; a < 3; ++a)
      p[a] = static_cast<float>(uniform_double(hash_keys(8, k, static_cast<std::uint64_t>(a)))) *
             grid.view().cell * static_cast<float>(grid.view().cells[a]);
    const float scale = grid.view().inv_cell;
    const std::size_t cell = cell_index(grid.view(), static_cast<int>(p[0] * scale),
                                        static_cast<int>(p[1] * scale), static_cast<int>(p[2] * scale));
    if (cell == kNoCell) {
      REQUIRE(field.density(p) == 0);
    } else {
      REQUIRE(field.density(p) <= field.majorant(cell) * 1.0001f);
    }
  }
}

TEST_CASE("probes find the field that the eight corners of their cells make, and nothing outside") {
  const Scene scene(cloud(900, 12, 1.5));
  constexpr std::size_t kProbes = 1003;
  constexpr float kAway = 1.7f;
  const kernels::TraceGrid& grid = scene.grid.view();
  std::vector<float> corners(scene.grid.brick_of_slot().size() * kernels::kBrickCorners);
  for (std::size_t c = 0; c < corners.size(); ++c) corners[c] = uniform_float(hash_keys(3, c));
  std::vector<float> from[3], along[3], value(kProbes);
  for (std::uint64_t a = 0; a < 3; ++a) {
    for (std::uint64_t i = 0; i < kProbes; ++i) {
      const float size = grid.cell * static_cast<float>(grid.cells[a]);
      from[a].push_back(size * (1.2f * uniform_float(hash_keys(4, a, i)) - 0.1f));
      along[a].push_back(uniform_float(hash_keys(5, a, i)) - 0.5f);
    }
  }
  const kernels::ProbeView probes{{from[0].data(), from[1].data(), from[2].data()},
                                  {along[0].data(), along[1].data(), along[2].data()}};
  for (const auto* table : supported_kernels()) {
    table->trace.probe(grid, corners.data(), probes, kAway, 0, kProbes, value.data());
    std::size_t within = 0;
    for (std::size_t i = 0; i < kProbes; ++i) {
      double p[3];
      for (int a = 0; a < 3; ++a) p[a] = static_cast<double>(std::fma(kAway, along[a][i], from[a][i]));
      const double expected = kernels::reference::probe(grid, corners.data(), p);
      within += expected > 0;
      INFO(table->isa << " probe " << i);
      REQUIRE(value[i] == Approx(expected).margin(2e-4));
    }
    CHECK(within > kProbes / 4);
  }
}

TEST_CASE("rays meet the surface where a fine march does, and shadow rays are blocked by it") {
  Snapshot snapshot = cloud(900, 12, 1.5);
  add_particle(snapshot, Vec3(9, 8, 7), 1);  // a lone one
  const Scene scene(std::move(snapshot));
  const double step = 0.002 * scene.grid.view().cell;
  for (const auto* table : supported_kernels()) {
    for (const RayKind kind : {RayKind::random, RayKind::axis_parallel, RayKind::inside, RayKind::far_away}) {
      const RayStream asked = make_rays(scene.grid, kind, 100, 33);
      RayStream rays = asked, shadows = asked;
      meet(scene, rays, table->trace);
      table->trace.surface_occluded(scene.field.view(), scene.field.surface(), shadows.view(), 0,
                                    shadows.size());
      std::size_t hits = 0, odd = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        CHECK((shadows.hit(i) == 0) == (rays.hit(i) != kernels::kNoHit));
        CHECK(shadows.t(i) == asked.t(i));
        if (kind == RayKind::far_away) {
          hits += rays.hit(i) != kernels::kNoHit;
          continue;
        }
        const double reach = std::min<double>(asked.t(i), 120);
        const double t = std::min(march(scene, asked, i, reach, step), first_ball(scene, asked, i));
        hits += t < reach;
        // A ray that grazes the surface for less than a step may go either way.
        odd += rays.hit(i) == kernels::kNoHit ? t < reach : std::abs(rays.t(i) - t) > 3 * step;
      }
      INFO(table->isa << ", kind " << static_cast<int>(kind) << ", hits " << hits);
      CHECK(hits > (kind == RayKind::inside ? 0 : 20));
      CHECK(odd <= 2);
    }
  }
}

TEST_CASE("fields and hits have the same bits on v3 and v4 and for any number of threads") {
  const Snapshot snapshot = cloud(30000, 14, 2);
  std::vector<std::uint64_t> hashes;
  for (const auto* table : supported_kernels()) {
    if (std::string(table->isa) == "base") continue;
    for (const int threads : {1, 2, 4}) {
      test::with_threads(threads, [&] {
        const Scene scene(snapshot, table->trace);
        std::uint64_t hash = 0;
        const auto add = [&hash](float f) {
          std::uint32_t bits;
          std::memcpy(&bits, &f, sizeof bits);
          hash = hash_keys(hash, bits);
        };
        for (std::size_t c = 0; c < scene.grid.brick_of_slot().size() * kernels::kBrickCorners; ++c)
          add(scene.field.surface().fill[c]);
        RayStream rays = make_rays(scene.grid, RayKind::random, 2000, 15);
        meet(scene, rays, table->trace);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          add(rays.t(i));
          hash = hash_keys(hash, rays.hit(i));
        }
        hashes.push_back(hash);
      });
    }
  }
  for (const std::uint64_t hash : hashes) CHECK(hash == hashes[0]);
}

TEST_CASE("a ball that moves by a tenth of a cell a frame does not pop") {
  // Its silhouette and its normals, seen along with it, change by little from frame to frame, and do not
  // drift.
  const int across = 120;
  const Vec3 way = Vec3(1, 0.3, 0.7).normalized() * 0.2;  // a tenth of a cell of the simulation
  std::vector<float> before;
  std::vector<Vec3f> normal_before;
  double first_area = 0;
  for (int frame = 0; frame < 12; ++frame) {
    const Vec3 center = frame * way;
    const Scene scene(lattice_ball(12, center));
    RayStream rays;
    for (int i = 0; i < across * across; ++i) {
      const double a = 13 * (2 * (i % across + 0.5) / across - 1),
                   b = 13 * (2 * (i / across + 0.5) / across - 1);
      rays.push(render_place(scene, center + Vec3(a, b, -30)), Vec3f(0, 0, 1), kInf);
    }
    meet(scene, rays);
    std::vector<float> t(rays.size());
    std::vector<Vec3f> normal(rays.size());
    double area = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      t[i] = rays.hit(i) == kernels::kNoHit ? -1 : rays.t(i);
      area += t[i] > 0;
      if (t[i] > 0) normal[i] = scene.field.normal(rays.at_hit(i), Vec3f(0, 0, -1));
    }
    if (frame == 0) first_area = area;
    CHECK(area == Approx(first_area).epsilon(0.01));
    if (!before.empty()) {
      double changed = 0, moved = 0, turned = 0, both = 0;
      for (std::size_t i = 0; i < t.size(); ++i) {
        changed += (t[i] > 0) != (before[i] > 0);
        if (!(t[i] > 0 && before[i] > 0)) continue;
        moved = std::max<double>(moved, std::abs(t[i] - before[i]));
        turned += std::pow(std::acos(std::min(1.f, normal[i].dot(normal_before[i]))), 2);
        ++both;
      }
      INFO("frame " << frame << ": " << changed / area << " of the silhouette, normals "
                    << std::sqrt(turned / both) * 180 / M_PI << " degrees, " << moved << " spacings");
      CHECK(changed < 0.01 * area);
      CHECK(std::sqrt(turned / both) < 2 * M_PI / 180);
    }
    before = t;
    normal_before = normal;
  }
}

TEST_CASE("a lone particle is a ball of about its own volume") {
  for (std::uint64_t k = 0; k < 20; ++k) {
    const Vec3 place(uniform_double(hash_keys(4, k, 0)), uniform_double(hash_keys(4, k, 1)),
                     uniform_double(hash_keys(4, k, 2)));
    Snapshot snapshot;
    add_particle(snapshot, place, 1);
    add_particle(snapshot, Vec3(30, 40, 50), 1);
    const Scene scene(std::move(snapshot));
    RayStream rays;
    const int across = 60;
    for (int i = 0; i < across * across; ++i) {
      const double a = 2 * (2 * (i % across + 0.5) / across - 1),
                   b = 2 * (2 * (i / across + 0.5) / across - 1);
      rays.push(render_place(scene, place + Vec3(a, b, -5)), Vec3f(0, 0, 1), kInf);
    }
    meet(scene, rays);
    double area = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) area += rays.hit(i) != kernels::kNoHit;
    const double radius = std::sqrt(area * 16 / (across * across) / M_PI);
    INFO("radius " << radius);
    CHECK(radius > 0.55);
    CHECK(radius < 0.8);
  }
}

}  // namespace firn::test::surface
