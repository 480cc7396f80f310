// SPDX-License-Identifier: MIT
// The denoiser: less noise than four times the samples have, and no other picture.
#include <cmath>

#include "tests/catch.h"
#include "tests/light/pictures.h"

using namespace firn;
using namespace firn::test;

namespace {

// A matt ball on a floor, under sun and sky.
RenderSetup open_air(int size) {
  RenderSetup setup = empty_setup(Vec3(0.5, 0.35, 0.8), Vec3(0.05, 0.05, 0), 28, size, 16, 4);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  Shape ball;
  ball.form = Ball{0.15};
  ball.pose.translation = Vec3(0, 0.15, 0.05);
  add_object(setup, ball, add_surface(setup, SurfaceKind::diffuse, 0.8f));
  setup.lights.push_back(SunLight{Vec3(-1, 0.5, 0.6), 2, Vec3f(3, 2.7f, 2.4f)});
  setup.lights.push_back(SkyLight{Vec3f(0.2f, 0.3f, 0.6f), Vec3f(0.5f, 0.6f, 0.8f), Vec3f::Constant(0.2f)});
  return setup;
}

// A snowball and a box in a room that a lamp above the picture lights.
RenderSetup room(int size) {
  RenderSetup setup = empty_setup(Vec3(0, 0.5, 1.9), Vec3(0, 0.33, 0), 30, size, 16, 6);
  const int white = add_surface(setup, SurfaceKind::diffuse, 0.7f);
  const int red = add_surface(setup, SurfaceKind::diffuse, 0.6f);
  setup.surfaces[red].albedo = Vec3f(0.6f, 0.1f, 0.1f);
  const auto slab = [&](const Vec3& center, const Vec3& half, int surface) {
    Shape box;
    box.form = Box{half};
    box.pose.translation = center;
    add_object(setup, box, surface);
  };
  slab(Vec3(0, -0.05, 0), Vec3(0.6, 0.05, 0.6), white);
  slab(Vec3(0, 1.05, 0), Vec3(0.6, 0.05, 0.6), white);
  slab(Vec3(0, 0.5, -0.65), Vec3(0.6, 0.6, 0.05), white);
  slab(Vec3(-0.6, 0.5, 0), Vec3(0.05, 0.6, 0.6), red);
  slab(Vec3(0.6, 0.5, 0), Vec3(0.05, 0.6, 0.6), white);
  slab(Vec3(0.25, 0.15, -0.2), Vec3(0.12, 0.15, 0.12), white);
  setup.lights.push_back(
      QuadLight{Vec3(-0.15, 0.98, -0.15), Vec3(0.3, 0, 0), Vec3(0, 0, 0.3), Vec3f::Constant(8)});
  return setup;
}

double rmse(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::pow(a.rgb[i] - b.rgb[i], 2);
  return std::sqrt(sum / static_cast<double>(a.rgb.size()));
}

}  // namespace

TEST_CASE("the denoiser at 16 samples beats 64 samples, and keeps the light") {
  constexpr int kSeeds = 2;
  for (const bool inside : {false, true}) {
    RenderSetup setup = inside ? room(96) : open_air(96);
    const Snapshot snapshot = inside ? snowball(Vec3(0, 0.15, 0.05), 0.15, 0.012) : Snapshot{};
    setup.image.samples = 1024;
    setup.seed = 100;
    const Picture truth = render(snapshot, setup);
    double four = 0, denoised = 0, bias = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      setup.seed = seed;
      setup.image.samples = 64;
      setup.denoise = false;
      four += rmse(render(snapshot, setup), truth);
      setup.image.samples = 16;
      const Picture plain = render(snapshot, setup);
      setup.denoise = true;
      const Picture smooth = render(snapshot, setup);
      denoised += rmse(smooth, truth);
      bias += luminance_of(mean(smooth)) / luminance_of(mean(plain)) - 1;
    }
    INFO((inside ? "room" : "open air") << ": error " << denoised / kSeeds << ", of 64 samples "
                                        << four / kSeeds << ", bias " << bias / kSeeds);
    CHECK(denoised <= four);
    CHECK(std::fabs(bias / kSeeds) < 0.005);
  }
}
