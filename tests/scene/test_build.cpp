// SPDX-License-Identifier: MIT
// What the simulation and the renderer are told about the ground, colliders, lights and surfaces.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "src/scene/place_shape.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"
#include "tests/scene/temporary_folder.h"

using namespace firn;
using firn::test::kBall;
using firn::test::read;

TEST_CASE("the ground is a level half space that is felt and seen") {
  const SceneConfig scene =
      read(kBall + "[ground]\nheight = 0.25\nfriction = 0.7\nsurface = \"a\"\n[[surface]]\nname = \"a\"");
  const SolverSetup simulation = build_simulation(scene);
  REQUIRE(simulation.colliders.size() == 1);
  CHECK(simulation.colliders[0].friction == 0.7);
  CHECK(signed_distance(simulation.colliders[0].shape, Vec3(9, 1, 9)) == Approx(0.75));
  const RenderSetup render = build_render(scene);
  REQUIRE(render.objects.size() == 1);
  CHECK(render.surfaces[render.objects[0].surface].name == "a");
}

TEST_CASE("a plane is solid against its normal, and a level one keeps the world's axes") {
  const Vec3 normal(1, 2, -0.5);
  const Shape plane = plane_shape(Vec3(1, 1, 1), normal);
  CHECK(signed_distance(plane, Vec3(1, 1, 1) + normal) == Approx(normal.norm()));
  CHECK((plane.pose.rotation.transpose() * plane.pose.rotation - Mat3::Identity()).norm() < 1e-12);
  CHECK(plane.pose.rotation.determinant() == Approx(1));
  CHECK((plane_shape(Vec3::Zero(), Vec3(0, 2, 0)).pose.rotation - Mat3::Identity()).norm() < 1e-12);
  CHECK(plane_shape(Vec3::Zero(), Vec3(3, 0, 0)).pose.rotation.determinant() == Approx(1));
}

TEST_CASE("the preview is refused with what it cannot show") {
  const std::string preview = "[image]\nintegrator = \"preview\"\n";
  CHECK(build_render(read(kBall + preview + "snow_light = \"inside\"\n")).image.integrator ==
        Integrator::preview);
  CHECK_REFUSES(read(kBall + preview + "reference = true\n"), "scene.toml:7:1: 'reference' asks for nothing");
  CHECK_REFUSES(read(kBall + preview + "[[medium]]\nshape = \"ball\"\nradius = 1\ncenter = [0, 0, 0]\n"),
                "scene.toml:6:1: 'preview' does not see a [[medium]]");
}

TEST_CASE("a rotation turns about x, then y, then z") {
  CHECK((rotation_matrix(Vec3(90, 0, 0)) * Vec3(0, 1, 0) - Vec3(0, 0, 1)).norm() < 1e-12);
  CHECK((rotation_matrix(Vec3(90, 90, 0)) * Vec3(0, 1, 0) - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((rotation_matrix(Vec3(90, 90, 90)) * Vec3(0, 1, 0) - Vec3(0, 1, 0)).norm() < 1e-12);
}

TEST_CASE("static friction is the dynamic one unless it is given, and never below it") {
  const std::string stone =
      "[[collider]]\nshape = \"ball\"\ncenter = [0, -3, 0]\nradius = 1\nfriction = 0.4\n";
  CHECK_FALSE(build_simulation(test::read(kBall + stone)).colliders[0].static_friction);
  CHECK(
      build_simulation(test::read(kBall + stone + "static_friction = 0.5\n")).colliders[0].static_friction ==
      0.5);
  CHECK(*build_simulation(test::read(kBall + "[ground]\nstatic_friction = 0.9\n"))
             .colliders[0]
             .static_friction == 0.9);
  CHECK_REFUSES(test::read(kBall + stone + "static_friction = 0.3\n"),
                "scene.toml:10:1: 'static_friction' is below 'friction'");
  CHECK_REFUSES(test::read(kBall + stone + "static_friction = -1\n"), "out of range: it must be at least 0");
  CHECK_REFUSES(test::read(kBall + "[ground]\nfriction = -0.5\n"),
                "scene.toml:6:12: 'friction' is -0.5, out of range: it must be at least 0");
}

TEST_CASE("invisible colliders are felt and not seen, objects are seen and not felt") {
  const SceneConfig scene =
      read(kBall +
           "[[collider]]\nshape = \"ball\"\ncenter = [0, -3, 0]\nradius = 1\nvisible = false\n"
           "[[object]]\nshape = \"box\"\ncenter = [0, 0.5, 0]\nsize = [1, 1, 1]\n");
  CHECK(build_simulation(scene).colliders.size() == 1);
  REQUIRE(build_render(scene).objects.size() == 1);
  CHECK(std::holds_alternative<Box>(build_render(scene).objects[0].shape.form));
}

TEST_CASE("a domain is a box about the middle of its corners") {
  const SolverSetup setup = build_simulation(
      read(kBall +
           "[simulation]\ndomain_min = [-1, -2, -1]\ndomain_max = [1, 2, 1]\ndomain_rotation = [0, 0, 90]"));
  REQUIRE(setup.domain);
  CHECK(signed_distance(*setup.domain, Vec3(1.9, 0, 0)) == Approx(-0.1));
  CHECK(signed_distance(*setup.domain, Vec3(0, 1.5, 0)) == Approx(0.5));
}

TEST_CASE("the grid follows a domain that is turned, and stays the world's in one that is not") {
  const std::string box = "[simulation]\ndomain_min = [-1, -2, -1]\ndomain_max = [3, 2, 1]\n";
  CHECK_FALSE(build_simulation(read(kBall + box)).frame);
  const SolverSetup setup = build_simulation(read(kBall + box + "domain_rotation = [0, 0, -30]"));
  REQUIRE(setup.frame);
  CHECK((setup.frame->to_world(Vec3::Zero()) - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((setup.frame->rotation * Vec3::UnitX() - Vec3(std::sqrt(0.75), -0.5, 0)).norm() < 1e-12);
}

TEST_CASE("a quad light shines along its direction or along edge_u x edge_v") {
  const SceneConfig scene = read(kBall +
                                 "[[light]]\ntype = \"quad\"\ncenter = [0, 3, 0]\nwidth = 2\nheight = 1\n"
                                 "direction = [0.3, -2, 0.1]\nradiance = 3\n");
  const QuadLight quad = std::get<QuadLight>(build_render(scene).lights[0]);
  const Vec3 normal = quad.edge_u.cross(quad.edge_v);
  CHECK(normal.norm() == Approx(2));
  CHECK(normal.normalized().dot(Vec3(0.3, -2, 0.1).normalized()) == Approx(1));
  CHECK((quad.corner + 0.5 * (quad.edge_u + quad.edge_v) - Vec3(0, 3, 0)).norm() < 1e-12);
}

TEST_CASE("a sun's azimuth goes from +Z to +X and its elevation upwards") {
  const auto direction = [](const std::string& keys) {
    const RenderSetup setup = build_render(read(kBall + "[[light]]\ntype = \"sun\"\n" + keys));
    return std::get<SunLight>(setup.lights[0]).direction;
  };
  CHECK((direction("azimuth = 0\nelevation = 0") - Vec3(0, 0, 1)).norm() < 1e-12);
  CHECK((direction("azimuth = 90\nelevation = 0") - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((direction("azimuth = 90\nelevation = 30") - Vec3(std::sqrt(0.75), 0.5, 0)).norm() < 1e-12);
  CHECK((direction("direction = [0, 5, 0]") - Vec3(0, 1, 0)).norm() < 1e-12);
}

TEST_CASE("the grid spacing follows from the particles across the smallest snow") {
  const std::string two = kBall + "[[snow]]\nshape = \"box\"\ncenter = [3, 0, 0]\nsize = [1, 0.05, 1]\n";
  CHECK(grid_spacing(read(two + "[simulation]\nparticles_across = 5")) == Approx(0.02));
  CHECK(grid_spacing(read(kBall + "[simulation]\nparticles_across = 20")) == Approx(0.02));
  CHECK(grid_spacing(read(kBall + "[simulation]\ndx = 0.03")) == 0.03);
}

TEST_CASE("files are found beside the scene file and a resolved scene finds them from anywhere") {
  const test::TemporaryFolder folder;
  folder.write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  folder.write("hill.pgm", "P2 2 2 255 255 255 255 255");
  const std::string path =
      folder.write("s.toml",
                   "[[snow]]\nshape = \"mesh\"\nfile = \"tetra.obj\"\nscale = 2\noffset = [0, 3, "
                   "0]\n[simulation]\ndx = 0.2\n"
                   "[[collider]]\nshape = \"height_field\"\nfile = \"hill.pgm\"\nextent = [4, 1, 4]\n");
  const SolverSetup setup = build_simulation(read_scene(path, {}));
  CHECK(setup.snow[0].particle_volume * static_cast<double>(setup.snow[0].position.size()) ==
        Approx(8.0 / 6));
  CHECK(signed_distance(setup.colliders[0].shape, Vec3(0, 2, 0)) == Approx(1));
  CHECK(signed_distance(setup.colliders[0].shape, Vec3(0, 0.2, 0)) == Approx(-0.2));
  const SceneConfig again = read(resolved_toml(read_scene(path, {})));
  CHECK(build_simulation(again).snow[0].position == setup.snow[0].position);
  CHECK(build_render(again).objects.size() == 1);
}

TEST_CASE("a day sky has the sun that it names, or the scene's") {
  const std::string sky = "[[light]]\ntype = \"day_sky\"\n",
                    sun = "[[light]]\ntype = \"sun\"\ndirection = [0, 1, 1]\n";
  CHECK(std::get<DaySkyLight>(build_render(read(kBall + sun + sky)).lights[1])
            .sun.isApprox(Vec3(0, 1, 1).normalized()));
  const std::string own = sky + "azimuth = 90\nelevation = 0\nturbidity = 5\n";
  const auto light = std::get<DaySkyLight>(build_render(read(kBall + sun + own)).lights[1]);
  CHECK(light.sun.isApprox(Vec3(1, 0, 0)));
  CHECK(light.turbidity == 5);
  CHECK_REFUSES(read(kBall + sky), "scene.toml:5:1: a day_sky needs direction, azimuth and elevation");
  CHECK_REFUSES(read(kBall + sky + "direction = [1, -1, 0]"),
                "scene.toml:5:1: the sun of this day_sky is below the horizon");
}

TEST_CASE(
    "image files become linear textures and lights, and damaged ones are refused where they are named") {
  const test::TemporaryFolder folder;
  folder.write("a.ppm", std::string("P6\n2 1\n255\n\xff\x80\x00\x00\x00\xff", 17));
  const float light[] = {1, 2, 30};
  folder.write("a.pfm", "PF\n1 1\n-1.0\n" + std::string(reinterpret_cast<const char*>(light), sizeof light));
  const auto scene = [&](const std::string& texture, const std::string& image) {
    return read_scene(
        folder.write("s.toml", kBall + "[[surface]]\nname = \"a\"\ntexture = \"" + texture +
                                   "\"\ntexture_size = 2\n[[light]]\ntype = \"image\"\nfile = \"" + image +
                                   "\"\nradiance = 2\n"),
        {});
  };
  const RenderSetup setup = build_render(scene("a.ppm", "a.pfm"));
  const ImageTexture& texture = *setup.surfaces[1].texture;
  REQUIRE((texture.width == 2 && texture.height == 1));
  CHECK((texture.pixel(0, 0) - Vec3f(1, 0.21586f, 0)).norm() < 1e-4f);
  CHECK((texture.pixel(1, 0) - Vec3f(0, 0, 1)).norm() < 1e-6f);
  CHECK(std::get<ImageLight>(setup.lights[0]).picture->pixel(0, 0) == Vec3f(1, 2, 30));
  // A resolved scene finds them from anywhere.
  CHECK(build_render(read(resolved_toml(scene("a.ppm", "a.pfm")))).surfaces[1].texture->width == 2);
  CHECK_REFUSES(scene("b.ppm", "a.pfm"), "s.toml:7:1: no such file: " + folder.path("b.ppm"));
  CHECK_REFUSES(scene("a.ppm", "b.pfm"), "s.toml:11:1: no such file: " + folder.path("b.pfm"));
  folder.write("dark.pfm", "PF\n9 9\n-1.0\n");
  CHECK_REFUSES(
      build_render(scene("a.ppm", "dark.pfm")),
      "s.toml:11:1: " + folder.path("dark.pfm") + ": damaged image: its size does not fit its header");
}
