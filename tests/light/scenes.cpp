// SPDX-License-Identifier: MIT
#include "tests/light/scenes.h"

#include <utility>

namespace firn::test {
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
RenderSetup lit_room(int size) {
  RenderSetup setup = empty_setup(Vec3(0, 0.5, 1.9), Vec3(0, 0.33, 0), 30, size, 16, 6);
  const int white = add_surface(setup, SurfaceKind::diffuse, 0.7f);
  const int red = add_surface(setup, SurfaceKind::diffuse, 0.6f);
  setup.surfaces[static_cast<std::size_t>(red)].albedo = Vec3f(0.6f, 0.1f, 0.1f);
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

// A snowball on a floor of snow's colour in low sun, full of facets.
RenderSetup glinting(int size) {
  RenderSetup setup = empty_setup(Vec3(0.2, 0.35, 0.9), Vec3(0, 0.1, 0), 28, size, 16, 4);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::diffuse, 0.8f));
  setup.snow[0].sparkle.density = 1e6;
  setup.snow[0].sparkle.size = 0.5e-3;
  setup.snow[0].sparkle.roughness = 3;
  setup.lights.push_back(SunLight{Vec3(-1, 0.6, -0.3), 0.2666, Vec3f(3, 2.7f, 2.4f)});
  setup.lights.push_back(SkyLight{Vec3f(0.2f, 0.3f, 0.6f), Vec3f(0.5f, 0.6f, 0.8f), Vec3f::Constant(0.2f)});
  return setup;
}

}  // namespace

std::vector<Scene> small_scenes(int size) {
  const Snapshot ball = snowball(Vec3(0, 0.15, 0.05), 0.15, 0.012);
  return {{"open air", open_air(size), {}},
          {"room", lit_room(size), ball},
          {"glinting snow", glinting(size), ball}};
}

}  // namespace firn::test
