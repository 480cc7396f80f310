// SPDX-License-Identifier: MIT
// Path tracing, light tracing and bidirectional path tracing are different estimates of the same picture:
// block by block they must agree within their own noise, measured over seeds.
#include <cmath>
#include <string>
#include <vector>

#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/estimate.h"

namespace firn::test::integrators {
namespace {

constexpr int kSize = 32, kBlock = 8;
// Means of fewer pictures are too skewed by rare bright paths, and tell too little of their own spread.
int seeds() { return makes_figures() ? 128 : 64; }

using Blocks = std::vector<Estimate>;

// The green channel of each block of pixels, over seeds.
Blocks measure(RenderSetup setup, const Snapshot& snapshot, Integrator integrator, int samples) {
  setup.image.integrator = integrator;
  setup.image.samples = samples;
  setup.image.width = setup.image.height = kSize;
  constexpr int kAcross = kSize / kBlock;
  const int count = seeds();
  // A picture's blocks.
  const auto pictures = side_by_side(static_cast<std::size_t>(count), [&](std::size_t seed) {
    RenderSetup its = setup;
    its.seed = 1000 * (static_cast<std::uint64_t>(integrator) + 1) + seed;
    const Picture picture = render(snapshot, its);
    std::vector<double> block(kAcross * kAcross);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x)
        block[y / kBlock * kAcross + x / kBlock] += picture.pixel(x, y)[1] / (kBlock * kBlock);
    }
    return block;
  });
  std::vector<double> sum(kAcross * kAcross), squares(kAcross * kAcross);
  for (const std::vector<double>& block : pictures) {
    for (std::size_t k = 0; k < block.size(); ++k) sum[k] += block[k], squares[k] += block[k] * block[k];
  }
  Blocks blocks;
  for (std::size_t k = 0; k < sum.size(); ++k) {
    const double mean = sum[k] / count;
    blocks.push_back({mean, std::sqrt(std::max(squares[k] / count - mean * mean, 0.0) / (count - 1))});
  }
  return blocks;
}

// The differences of all pairs of measurements, and their curve.
struct Agreement {
  Scores scores;
  Curve curve{"light_integrators", "series,block,expected,measured,error"};

  // Blocks that are the same in every seed must be the same in both.
  void compare(const std::string& name, const Blocks& a, const Blocks& b) {
    Scores own;
    for (std::size_t k = 0; k < a.size(); ++k) {
      const double error = std::hypot(a[k].error, b[k].error);
      INFO(name << ", block " << k << ": " << a[k].mean << " +- " << a[k].error << " and " << b[k].mean
                << " +- " << b[k].error);
      if (error < 1e-7) {
        CHECK(a[k].mean == Approx(b[k].mean).margin(1e-5));
        continue;
      }
      CHECK(std::fabs(a[k].mean - b[k].mean) < 4.5 * error);
      own.add(b[k].mean, a[k].mean, error);
      scores.add(b[k].mean, a[k].mean, error);
      curve.add(name, {static_cast<double>(k), a[k].mean, b[k].mean, error});
    }
    require_unbiased(own);
  }
};

// A scene and the samples of each picture of it by each integrator. 0: light subpaths cannot be all of the
// path.
struct Compared {
  std::string name;
  RenderSetup setup;
  Snapshot snapshot;
  int path = 16, bidirectional = 8, light = 0;
};

void compare(const Compared& scene, Agreement& agreement) {
  RenderSetup setup = scene.setup;
  agreement.compare(scene.name + ": path, bidirectional",
                    measure(setup, scene.snapshot, Integrator::path, scene.path),
                    measure(setup, scene.snapshot, Integrator::bidirectional, scene.bidirectional));
  if (scene.light == 0) return;
  // As many scatterings as light subpaths can have, for both; from both ends a path could have twice as
  // many.
  setup.image.max_bounces = 14;
  setup.image.light_bounces = 15;
  agreement.compare(scene.name + ": path, light",
                    measure(setup, scene.snapshot, Integrator::path, scene.path),
                    measure(setup, scene.snapshot, Integrator::light, scene.light));
}

void add_box(RenderSetup& setup, const Vec3& center, const Vec3& size, int surface) {
  Shape shape;
  shape.form = Box{0.5 * size};
  shape.pose.translation = center;
  add_object(setup, shape, surface);
}
void add_ball(RenderSetup& setup, const Vec3& center, double radius, int surface) {
  Shape shape;
  shape.form = Ball{radius};
  shape.pose.translation = center;
  add_object(setup, shape, surface);
}

// A room, open to the camera: floor, ceiling, three walls, a lamp under the ceiling.
RenderSetup room() {
  RenderSetup setup = empty_setup(Vec3(0, 0.5, 2.2), Vec3(0, 0.5, 0), 36, kSize, 1, 1000);
  const int white = add_surface(setup, SurfaceKind::diffuse, 0.7f),
            grey = add_surface(setup, SurfaceKind::diffuse, 0.3f);
  add_box(setup, Vec3(0, -0.05, 0), Vec3(1.2, 0.1, 1.2), white);
  add_box(setup, Vec3(0, 1.05, 0), Vec3(1.2, 0.1, 1.2), white);
  add_box(setup, Vec3(0, 0.5, -0.55), Vec3(1.2, 1, 0.1), white);
  add_box(setup, Vec3(-0.55, 0.5, 0), Vec3(0.1, 1, 1.2), grey);
  add_box(setup, Vec3(0.55, 0.5, 0), Vec3(0.1, 1, 1.2), grey);
  setup.lights.push_back(
      QuadLight{Vec3(-0.15, 0.98, -0.15), Vec3(0.3, 0, 0), Vec3(0, 0, 0.3), Vec3f::Constant(10)});
  return setup;
}

Medium fog_ball(const Vec3& center, double radius, double sigma, double albedo, double g) {
  Medium medium;
  medium.shape.form = Ball{radius};
  medium.shape.pose.translation = center;
  medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma * albedo));
  medium.sigma_a = Vec3f::Constant(static_cast<float>(sigma * (1 - albedo)));
  medium.g = static_cast<float>(g);
  return medium;
}

// A ball of coarse, thin snow, so that few collisions make the picture.
void make_thin(RenderSetup& setup) {
  setup.image.snow_light = SnowLight::inside;
  setup.image.reference =
      true;  // similarity counts collisions from the eye in `path`, and goes by depth in others
  setup.snow[0].density = 300;
  setup.snow[0].extinction = 0.1;  // mean free path 33 mm
  setup.snow[0].anisotropy = 0.6;
  setup.snow[0].ice_per_collision = 0.01;
}

Compared fog_lit_from_behind() {
  RenderSetup setup = empty_setup(Vec3(0, 0.2, 1.2), Vec3::Zero(), 25, kSize, 1, 1000);
  setup.media.push_back(fog_ball(Vec3::Zero(), 0.2, 15, 0.95, 0.5));
  add_box(setup, Vec3(0, -0.3, 0), Vec3(2, 0.1, 2), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  setup.lights.push_back(SphereLight{Vec3(0.1, 0.3, -0.6), 0.1, Vec3f::Constant(20)});
  return {"fog lit from behind", setup, {}, 16, 8, 16};
}

Compared milk_behind_glass() {
  RenderSetup setup = empty_setup(Vec3(0, 0.2, 1.2), Vec3::Zero(), 25, kSize, 1, 1000);
  setup.media.push_back(fog_ball(Vec3::Zero(), 0.2, 20, 0.98, 0.3));
  const int glass = add_surface(setup, SurfaceKind::dielectric, 1);
  setup.surfaces[static_cast<std::size_t>(glass)].ior = 1.4f;
  add_ball(setup, Vec3::Zero(), 0.2, glass);
  add_box(setup, Vec3(0, -0.3, 0), Vec3(2, 0.1, 2), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  setup.lights.push_back(SphereLight{Vec3(0.4, 0.8, 0.3), 0.3, Vec3f::Constant(5)});
  setup.lights.push_back(ConstantLight{Vec3f::Constant(0.3f)});
  return {"milk behind glass", setup, {}, 32, 16};
}

Compared snow_under_sun_and_sky() {
  RenderSetup setup = empty_setup(Vec3(0, 0.2, 0.9), Vec3::Zero(), 25, kSize, 1, 1000);
  make_thin(setup);
  add_box(setup, Vec3(0, -0.2, 0), Vec3(1, 0.1, 1), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  setup.lights.push_back(SunLight{Vec3(1, 1, 0.5), 2, Vec3f::Constant(2)});
  setup.lights.push_back(SkyLight{Vec3f::Constant(0.3f), Vec3f::Constant(0.5f), Vec3f::Constant(0.2f)});
  return {"snow under sun and sky", setup, snowball(Vec3::Zero(), 0.15, 0.012), 16, 8, 16};
}

Compared lamp_behind_snow() {
  RenderSetup setup = empty_setup(Vec3(0, 0.1, 0.9), Vec3::Zero(), 30, kSize, 1, 1000);
  make_thin(setup);
  setup.lights.push_back(
      QuadLight{Vec3(-0.1, -0.1, -0.3), Vec3(0.2, 0, 0), Vec3(0, 0.2, 0), Vec3f::Constant(5)});
  add_box(setup, Vec3(0, -0.2, 0), Vec3(1, 0.1, 1), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  return {"lamp behind snow", setup, snowball(Vec3::Zero(), 0.15, 0.012), 16, 8, 16};
}

Compared mirrors_glass_gloss_and_snow() {
  RenderSetup setup = room();
  make_thin(setup);
  const int gloss = add_surface(setup, SurfaceKind::glossy, 0.6f),
            glass = add_surface(setup, SurfaceKind::dielectric, 1),
            mirror = add_surface(setup, SurfaceKind::mirror, 0.9f);
  setup.surfaces[static_cast<std::size_t>(gloss)].roughness = 0.5f;
  add_ball(setup, Vec3(-0.28, 0.16, 0.1), 0.15, gloss);
  add_ball(setup, Vec3(0.28, 0.16, 0.2), 0.12, glass);
  add_box(setup, Vec3(0.2, 0.3, -0.3), Vec3(0.3, 0.6, 0.1), mirror);
  return {"mirrors, glass, gloss, snow", setup, snowball(Vec3(0, 0.5, -0.1), 0.12, 0.012), 48, 24};
}

}  // namespace

TEST_CASE("path, light and bidirectional agree, block by block, on scenes of all kinds",
          "[light][figure][slow]") {
  Agreement agreement;
  // Random numbers without order are noisier, and no other light.
  Compared independent{"room, independent", room(), {}, 16, 8};
  independent.setup.image.sampler = SamplerKind::independent;
  for (const Compared& scene :
       {Compared{"room", room(), {}, 16, 8, 16}, independent, fog_lit_from_behind(), milk_behind_glass(),
        snow_under_sun_and_sky(), lamp_behind_snow(), mirrors_glass_gloss_and_snow()})
    compare(scene, agreement);
  CHECK(agreement.scores.size() > 150);
  require_unbiased(agreement.scores);
}

}  // namespace firn::test::integrators
