// SPDX-License-Identifier: MIT
// --set and [quick]: which records a path names, in which order they come, and how their mistakes are named.
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"

namespace firn::test::override {

namespace {

const std::string kTwo =
    "[[snow]]\nname = \"left\"\nshape = \"ball\"\ncenter = [0, 1, 0]\nradius = 0.1\n"
    "[[snow]]\nname = \"right\"\nshape = \"ball\"\ncenter = [1, 1, 0]\nradius = 0.2\n"
    "[simulation]\nparticles_across = 12\n"
    "[quick.image]\nwidth = 64\n"
    "[quick.snow]\nradius = 0.05\nparticles_per_cell = 4\n"
    "[quick.snow.right]\nradius = 0.06\n"
    "[quick.simulation]\ndx = 0.03\n";

}  // namespace

TEST_CASE("an override reaches every record, one by number, one by name, or a table that is not written") {
  CHECK(read(kTwo, {{"snow.density", "200"}}).snow[1].material.density == 200);
  CHECK(read(kTwo, {{"snow[1].radius", "0.5"}}).snow[0].shape.radius == 0.1);
  CHECK(read(kTwo, {{"snow[1].radius", "0.5"}}).snow[1].shape.radius == 0.5);
  CHECK(read(kTwo, {{"snow.left.radius", "0.5"}}).snow[0].shape.radius == 0.5);
  CHECK(read(kTwo, {{"snow.left.radius", "0.5"}}).snow[1].shape.radius == 0.2);
  CHECK(read(kTwo, {{"camera.fov", "20"}}).camera.fov == 20);
  CHECK(read(kTwo, {{"ground.friction", "0.9"}}).ground->friction == 0.9);
  CHECK(read(kTwo, {{"name", "other"}}).name == "other");
  CHECK(read(kTwo, {{"snow.velocity", "[1, 2, 3]"}}).snow[0].velocity == Vec3(1, 2, 3));
}

TEST_CASE("a bare word is a string and the last override counts") {
  CHECK(read(kTwo, {{"snow.preset", "powder"}}).snow[0].material.density == 120);
  CHECK(read(kTwo, {{"snow.preset", "\"powder\""}}).snow[0].material.density == 120);
  CHECK(read(kTwo, {{"image.width", "10"}, {"image.width", "20"}}).image.width == 20);
}

TEST_CASE("the quick table gives the small size, by name before for all, and overrides come after it") {
  const SceneConfig full = read(kTwo);
  CHECK(full.image.width == 960);
  CHECK(full.snow[0].shape.radius == 0.1);
  const SceneConfig quick = read(kTwo, {}, true);
  CHECK(quick.image.width == 64);
  CHECK(quick.snow[0].shape.radius == 0.05);
  CHECK(quick.snow[1].shape.radius == 0.06);
  CHECK(quick.snow[1].particles_per_cell == 4);
  CHECK(read(kTwo, {{"snow.radius", "0.07"}}, true).snow[1].shape.radius == 0.07);
}

TEST_CASE("setting dx takes particles_across out and the other way round") {
  CHECK(read(kTwo, {}, true).simulation.dx == 0.03);
  CHECK_FALSE(read(kTwo, {}, true).simulation.particles_across.has_value());
  const SceneConfig back = read(kTwo, {{"simulation.particles_across", "9"}}, true);
  CHECK(back.simulation.particles_across == 9);
  CHECK_FALSE(back.simulation.dx.has_value());
}

TEST_CASE("a mistake in an override is named by the override") {
  CHECK_REFUSES(read(kTwo, {{"snow.raduis", "1"}}),
                "--set snow.raduis: unknown key 'raduis' in [[snow]], did you mean 'radius'?");
  CHECK_REFUSES(read(kTwo, {{"snow.left.radius", "-1"}}),
                "--set snow.left.radius: 'radius' is -1.0, out of range: it must be above 0 m");
  CHECK_REFUSES(read(kTwo, {{"snow.radius", "big"}}),
                "--set snow.radius: 'radius': expected a number in metres, got the string \"big\"");
  CHECK_REFUSES(read(kTwo, {{"snow.radius", "1e999"}}), "got the string \"1e999\"");
  CHECK_REFUSES(read(kTwo, {{"snow.radius", std::string(41, 'x')}}), "got a string");
  for (const char* number :
       {"99999999999999999999", "-9223372036854775809", "+18446744073709551616", "007"}) {
    CHECK_REFUSES(read(kTwo, {{"simulation.particles_across", number}}),
                  std::string("--set simulation.particles_across: '") + number + "' is not a TOML value: ");
  }
  CHECK_REFUSES(read(kTwo, {{"snow.lft.radius", "1"}}),
                "--set snow.lft.radius: no [[snow]] is named 'lft'; there are: left, right");
  CHECK_REFUSES(read(kTwo, {{"snow[2].radius", "1"}}),
                "--set snow[2].radius: the scene has only 2 [[snow]], counted from 0");
  CHECK_REFUSES(read(kTwo, {{"collider.friction", "1"}}),
                "--set collider.friction: the scene has no [[collider]]");
  CHECK_REFUSES(read(kTwo, {{"imgae.width", "1"}}),
                "--set imgae.width: unknown table 'imgae', did you mean 'image'?");
  CHECK_REFUSES(read(kTwo, {{"image", "1"}}), "--set image: expected image.KEY: each key is set by itself");
  CHECK_REFUSES(read(kTwo, {{"snow", "1"}}), "--set snow: expected snow.KEY, snow[0].KEY or snow.NAME.KEY");
  CHECK_REFUSES(read(kTwo, {{"snow.center", "[1, 2"}}), "--set snow.center: '[1, 2' is not a TOML value");
}

TEST_CASE("a mistake in the quick table is found even when the full size is read") {
  CHECK_REFUSES(read(kBall + "[quick.image]\nwidth = -3"), "scene.toml:6:9: 'width' is -3, out of range");
  CHECK_REFUSES(read(kBall, {}, true), "scene.toml: the scene has no [quick] table");
}

}  // namespace firn::test::override
