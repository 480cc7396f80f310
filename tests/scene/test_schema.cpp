// SPDX-License-Identifier: MIT
// The schema is the only list of keys: what it says is what people are told, and what is resolved reads back.
#include "src/scene/schema.h"

#include <fstream>
#include <set>
#include <sstream>

#include "src/scene/presets.h"
#include "src/scene/suggest.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"

namespace firn::test::schema {

namespace {

std::string params(const std::string& prefix) {
  std::ostringstream out;
  print_params(out, prefix);
  return out.str();
}

// One record of every table, one light of every type, one surface of every type.
const std::string kEverything =
    "name = \"all\"\ndescription = \"a \\\"quoted\\\" line\\nand another\"\n" + kBall +
    "velocity = [0.1, -1e-7, 3e12]\nspin = [0, 1, 2]\npreset = \"wet\"\ndensity = 123.456\nalbedo = 0.7\n"
    "[[snow]]\nname = \"hooke\"\nshape = \"cylinder\"\ncenter = [2, 2, 2]\nradius = 0.3\nheight = 1\nmodel = "
    "\"neo_hookean\"\n"
    "mu = 1e5\nlambda = 2e5\nrotation = [10, 20, 30]\n"
    "[[snow]]\nshape = \"flakes\"\ncenter = [0, 5, 0]\nradius = 0.02\nsize = [1, 1, 1]\ncount = 12\n"
    "[simulation]\ndx = 0.01\ndt = 1e-5\ndomain_min = [-5, -5, -5]\ndomain_max = [9, 9, 9]\n"
    "[ground]\nheight = -1\nsurface = \"mirror\"\n"
    "[[collider]]\nshape = \"plane\"\npoint = [0, -2, 0]\nnormal = [0, 1, 1]\ncontact = \"sticky\"\n"
    "[[object]]\nshape = \"box\"\ncenter = [0, 0, 0]\nsize = [1, 2, 3]\nsurface = \"lamp\"\n"
    "[[light]]\ntype = \"quad\"\ncorner = [0, 9, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]\nradiance = [1, "
    "2, 3]\n"
    "[[light]]\ntype = \"sphere\"\ncenter = [0, 9, 0]\nradius = 1\nradiance = 0.1\n"
    "[[light]]\ntype = \"sun\"\nazimuth = 30\nelevation = 10\nirradiance = 2\n"
    "[[light]]\ntype = \"sky\"\nzenith = 0.2\n[[light]]\ntype = \"constant\"\nradiance = 1\n"
    "[[surface]]\nname = \"mirror\"\ntype = \"mirror\"\nalbedo = 0.9\n"
    "[[surface]]\nname = \"lamp\"\ntype = \"emission\"\nemission = 5\n"
    "[output]\nformats = [\"png\", \"pfm\"]\nmovie = false\n";

}  // namespace

TEST_CASE("params lists every key of the schema with its type, default and meaning") {
  std::string all = "\n";
  all += params("");
  std::size_t keys = 0;
  for (const TableSpec& table : firn::schema()) {
    for (const KeySpec& key : table.keys) {
      const std::string name = table.name.empty() ? key.name : table.name + "." + key.name;
      INFO(name);
      CHECK(all.find("\n" + name + "\n    " + type_text(key)) != std::string::npos);
      CHECK(std::string(key.notes.meaning).size() > 3);
      ++keys;
    }
  }
  CHECK(keys > 100);
}

TEST_CASE("params with a prefix lists the keys that begin with it") {
  CHECK(params("image.w") ==
        "image.width\n    a whole number [pixels]; default: 960; range: 1 to 32768\n"
        "    of the picture\n");
  CHECK(params("width").find("image.width") != std::string::npos);    // anywhere in the name
  CHECK(params("PREETHAM").find("light.type") != std::string::npos);  // in the meaning
  CHECK_REFUSES(params("raduis"),
                "no key of a scene has 'raduis' in its name or meaning, did you mean 'radius'?");
  CHECK_REFUSES(params("no.such"), "'no.such'");
}

TEST_CASE("no key is listed twice and every condition names a choice of its table") {
  std::set<std::string> names;
  for (const TableSpec& table : firn::schema()) {
    for (const KeySpec& key : table.keys) {
      CHECK(names.insert(table.name + "." + key.name).second);
      const Condition& with = key.notes.with;
      if (with.key.empty()) continue;
      const KeySpec* other = table.find(with.key);
      REQUIRE(other);
      for (const std::string& value : with.values) {
        CHECK(std::count(other->notes.choices.begin(), other->notes.choices.end(), value) == 1);
      }
    }
  }
}

TEST_CASE("a resolved scene reads back to itself") {
  for (const std::string& text : {kBall, kEverything}) {
    const SceneConfig scene = read(text);
    const std::string resolved = resolved_toml(scene);
    INFO(resolved);
    CHECK(resolved_toml(read(resolved)) == resolved);
  }
}

TEST_CASE("a resolved scene holds the values that were written and the defaults that were not") {
  const SceneConfig scene = read(resolved_toml(read(kEverything)));
  CHECK(scene.description == "a \"quoted\" line\nand another");
  CHECK(scene.snow[0].velocity == Vec3(0.1, -1e-7, 3e12));
  CHECK(scene.snow[0].material.density == 123.456);
  CHECK(scene.snow[0].material.critical_stretch == find_preset("wet").material.critical_stretch);
  CHECK(scene.snow[1].material.model == kKindOf<kernels::NeoHookean>);
  CHECK(elastic_moduli(scene.snow[1].material).mu == Approx(1e5));
  CHECK(elastic_moduli(scene.snow[1].material).lambda == Approx(2e5));
  CHECK(scene.snow[2].shape.count == 12);
  CHECK(scene.lights.size() == 5);
  CHECK(scene.lights[0].radiance == Vec3f(1, 2, 3));
  CHECK(scene.surfaces[1].kind == SurfaceKind::emission);
  CHECK(scene.colliders[0].contact == Contact::sticky);
  CHECK(scene.output.formats == std::vector<std::string>{"png", "pfm"});
  CHECK(*scene.simulation.dt == 1e-5);
}

TEST_CASE("what is not said has its default, also a light") {
  const SceneConfig scene = read(kBall);
  CHECK(scene.name == "scene");
  CHECK(scene.snow[0].name == "snow0");
  CHECK(*scene.simulation.particles_across == 40);
  CHECK(scene.lights.size() == 2);
  CHECK_FALSE(scene.ground.has_value());
  CHECK(read(kBall + "[ground]").ground->height == 0);
}

TEST_CASE("keys that are written beat the preset, wherever they stand") {
  const SceneConfig scene = read(kBall + "density = 77\npreset = \"wet\"\n");
  CHECK(scene.snow[0].material.density == 77);
  CHECK(scene.snow[0].material.hardening == find_preset("wet").material.hardening);
}

TEST_CASE("every preset lies in the ranges of the schema") {
  for (const Preset& preset : presets()) {
    const SceneConfig scene = read(kBall + "preset = \"" + preset.name + "\"");
    CHECK_NOTHROW(read(resolved_toml(scene)));
    CHECK(std::string(preset.source).size() > 10);
  }
}

TEST_CASE("the page docs/scene_format.md is what the schema says") {
  std::ifstream file(FIRN_SOURCE_ROOT "/docs/scene_format.md", std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  const bool up_to_date = text.str() == scene_format_markdown();
  INFO("write it anew: firn params --markdown > docs/scene_format.md");
  CHECK(up_to_date);
}

TEST_CASE("the nearest name is suggested, a far one is not") {
  const std::vector<std::string> names = {"radius", "center", "size", "spin"};
  CHECK(suggestion("raduis", names) == ", did you mean 'radius'?");
  CHECK(suggestion("centre", names) == ", did you mean 'center'?");
  CHECK(suggestion("spni", names) == ", did you mean 'spin'?");
  CHECK(suggestion("viscosity", names).empty());
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("ab", "ba") == 1);
}

}  // namespace firn::test::schema
