// SPDX-License-Identifier: MIT
// Every mistake in a scene ends in one line that says where and what.
#include "src/scene/emit.h"
#include "src/scene/name.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"
#include "tests/scene/temporary_folder.h"

namespace firn::test::error {

namespace {

struct Mistake {
  std::string text;
  std::string line;  // the whole message
};

void check_all(const std::vector<Mistake>& mistakes) {
  for (const Mistake& mistake : mistakes) {
    const test::Refusal refusal = test::refusal([&] { build_simulation(test::read(mistake.text)); });
    INFO(mistake.text);
    CHECK(refusal.line == mistake.line);
    CHECK(refusal.code == ErrorCode::usage);
  }
}

std::string ball_with(const std::string& old_text, const std::string& new_text) {
  std::string text = kBall;
  return text.replace(text.find(old_text), old_text.size(), new_text);
}

}  // namespace

TEST_CASE("an unknown key or table is named where it stands, with the nearest known one") {
  check_all({
      {kBall + "raduis = 3", "scene.toml:5:1: unknown key 'raduis' in [[snow]], did you mean 'radius'?"},
      {kBall + "  zzzzzz = 3", "scene.toml:5:3: unknown key 'zzzzzz' in [[snow]]"},
      {"nmae = \"a\"\n" + kBall, "scene.toml:1:1: unknown key 'nmae', did you mean 'name'?"},
      {kBall + "[camara]\nfov = 3", "scene.toml:5:2: unknown table 'camara', did you mean 'camera'?"},
      {kBall + "[quick.image]\nwidht = 3",
       "scene.toml:6:1: unknown key 'widht' in [image], did you mean 'width'?"},
      {kBall + "[quick.snow.left]\nradius = 3",
       "scene.toml:6:1: no [[snow]] is named 'left'; there are: snow0"},
  });
}

TEST_CASE("a value of the wrong type is told from the expected one with its unit") {
  check_all({
      {ball_with("0.1", "\"wide\""),
       "scene.toml:4:10: 'radius': expected a number in metres, got the string \"wide\""},
      {ball_with("[0.0, 0.5, 0.0]", "[1, 2]"),
       "scene.toml:3:10: 'center': expected 3 numbers (m), got an array of 2"},
      {ball_with("0.5, 0.0]", "true, 0.0]"),
       "scene.toml:3:16: 'center': expected 3 numbers (m), got true or false among them"},
      {kBall + "density = [400]",
       "scene.toml:5:11: 'density': expected a number in kg/m^3, got an array of 1"},
      {kBall + "plasticity = 1", "scene.toml:5:14: 'plasticity': expected true or false, got a whole number"},
      {kBall + "preset = 3",
       "scene.toml:5:10: 'preset': expected one of fresh, powder, packed, wet, ice_crust, dry_slab, "
       "weak_layer, sand, "
       "got a whole number"},
      {kBall + "[image]\nsamples = 1.5", "scene.toml:6:11: 'samples': expected a whole number, got a number"},
      {kBall + "[simulation]\ndt = \"auot\"",
       "scene.toml:6:6: 'dt': expected a number in seconds, got the string \"auot\""},
      {kBall + "[time]\nfps = 1979-05-27",
       "scene.toml:6:7: 'fps': expected a number in 1/s, got a date or time"},
      {kBall + "[output]\nformats = [\"png\", \"pgf\"]",
       "scene.toml:6:19: 'formats': expected list of png, ppm, pfm, exr, got 'pgf', did you mean 'png'?"},
      {kBall + "preset = \"freshh\"",
       "scene.toml:5:10: 'preset': expected one of fresh, powder, packed, wet, ice_crust, dry_slab, "
       "weak_layer, sand, "
       "got 'freshh', did you mean 'fresh'?"},
  });
}

TEST_CASE("a table is written the way that its number of records asks for") {
  check_all({
      {"[snow]\nradius = 1",
       "scene.toml:1:2: there may be several of these: write [[snow]], in two brackets"},
      {kBall + "[[camera]]\nfov = 3", "scene.toml:5:3: 'camera' is a table: write [camera]"},
      {"camera = 3\n" + kBall, "scene.toml:1:1: 'camera' is a table: write [camera]"},
      {"snow = [3]", "scene.toml:1:9: 'snow' is a list of tables: write [[snow]]"},
  });
}

TEST_CASE("a value out of range is told the range") {
  check_all({
      {ball_with("0.1", "0"), "scene.toml:4:10: 'radius' is 0.0, out of range: it must be above 0 m"},
      {ball_with("0.1", "-2.5"), "scene.toml:4:10: 'radius' is -2.5, out of range: it must be above 0 m"},
      {kBall + "poisson_ratio = 0.5",
       "scene.toml:5:17: 'poisson_ratio' is 0.5, out of range: it must be 0 to below 0.5"},
      {kBall + "poisson_ratio = -0.1",
       "scene.toml:5:17: 'poisson_ratio' is -0.1, out of range: it must be 0 to below 0.5"},
      {kBall + "model = \"drucker_prager\"\nfriction_angle = -1",
       "scene.toml:6:18: 'friction_angle' is -1.0, out of range: it must be 0 to below 90 degrees"},
      {kBall + "model = \"drucker_prager\"\ncohesion = -0.5",
       "scene.toml:6:12: 'cohesion' is -0.5, out of range: it must be 0 to 1"},
      {kBall + "jp_min = 1.5", "scene.toml:5:10: 'jp_min' is 1.5, out of range: it must be above 0 to 1"},
      {kBall + "model = \"neo_hookean\"\nsigma_max = 0.9",
       "scene.toml:6:13: 'sigma_max' is 0.9, out of range: it must be at least 1"},
      {kBall + "model = \"neo_hookean\"\nsigma_min = 1.2",
       "scene.toml:6:13: 'sigma_min' is 1.2, out of range: it must be above 0 to 1"},
      {kBall + "terminal_velocity = 0.0",
       "scene.toml:5:21: 'terminal_velocity' is 0.0, out of range: it must be above 0 m/s"},
      {kBall + "[time]\nframes = 0", "scene.toml:6:10: 'frames' is 0, out of range: it must be 1 to 1000000"},
      {kBall + "[image]\nsamples = 0",
       "scene.toml:6:11: 'samples' is 0, out of range: it must be 1 to 1000000"},
      {kBall + "young_modulus = inf", "scene.toml:5:17: 'young_modulus' is not a finite number"},
  });
}

TEST_CASE("a table that lacks a key says which, with its unit") {
  check_all({
      {"\n[[snow]]\nname = \"left\"\nshape = \"ball\"\ncenter = [0, 0, 0]",
       "scene.toml:2:1: [[snow]] 'left' lacks 'radius', a number in metres: of the ball, of the cylinder, of "
       "the capsule, of one flake"},
      {"[[snow]]\nradius = 1",
       "scene.toml:1:1: [[snow]] lacks 'shape', one of ball, box, cylinder, capsule, height_field, mesh, "
       "flakes, particles: what "
       "it is "
       "shaped like"},
      {kBall + "[[light]]\ntype = \"sphere\"\nradius = 1\nradiance = 3",
       "scene.toml:5:1: a sphere light needs 'center', 3 numbers (m)"},
  });
}

TEST_CASE("a key of another shape, type or model is refused instead of ignored") {
  check_all({
      {kBall + "size = [1, 1, 1]",
       "scene.toml:5:1: 'size' belongs to shape = box or flakes, but this one has shape = ball"},
      {kBall + "sigma_min = 0.9",
       "scene.toml:5:1: 'sigma_min' belongs to model = neo_hookean, but this one has model = snow"},
      {kBall + "[[light]]\ntype = \"sky\"\nradiance = 3",
       "scene.toml:7:1: 'radiance' belongs to type = quad or sphere or constant or image, but this one has "
       "type = "
       "sky"},
  });
}

TEST_CASE("contradictions are refused at the key that makes them") {
  const std::string grid = "[simulation]\ndx = 0.02\n";  // lines 5 and 6
  check_all({
      {kBall + grid + "particles_across = 30",
       "scene.toml:7:1: both dx and particles_across are given: one follows from the other"},
      {kBall + grid + "domain_min = [0, 0, 0]",
       "scene.toml:7:1: domain_min and domain_max are given together or not at all"},
      {kBall + grid + "domain_min = [0, 0, 0]\ndomain_max = [1, 0, 1]",
       "scene.toml:8:1: domain_max is not above domain_min in every axis"},
      {kBall + grid + "domain_rotation = [0, 0, 30]",
       "scene.toml:7:1: 'domain_rotation' turns the domain's box: give domain_min and domain_max too"},
      {kBall + grid + "domain_min = [1, 0, 0]\ndomain_max = [2, 1, 1]",
       "scene.toml:3:1: snow 'snow0' starts outside the domain box"},
      {kBall + "mu = 1e5", "scene.toml:5:1: mu and lambda are given together or not at all"},
      {kBall + "mu = 1e5\nlambda = 1e5\nyoung_modulus = 1e5",
       "scene.toml:7:1: both young_modulus and mu, lambda are given: one follows from the other"},
      {kBall + "[camera]\nposition = [1, 1, 1]\ntarget = [1, 1, 1]",
       "scene.toml:7:1: the camera's position and target are the same point"},
      {kBall + "[camera]\nposition = [0, 2, 0]\ntarget = [0, 1, 0]",
       "scene.toml:5:1: the camera's up direction is the direction that it looks in"},
      {kBall + "[ground]\nsurface = \"feild\"\n[[surface]]\nname = \"field\"",
       "scene.toml:6:1: no [[surface]] is named 'feild', did you mean 'field'?"},
      {kBall + "[[surface]]\nname = \"a\"\n[[surface]]\nname = \"a\"",
       "scene.toml:8:1: two [[surface]] are named 'a'"},
      {kBall + "name = \"snow1\"\n[[snow]]\nshape = \"ball\"\ncenter = [1, 1, 1]\nradius = 1",
       "scene.toml:6:1: two [[snow]] are named 'snow1'"},
      {"name = \"a/b\"\n" + kBall, "scene.toml:1:1: 'a/b' cannot be a name: use letters, digits, _ and -"},
      {kBall + "[[collider]]\nshape = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 0]",
       "scene.toml:8:1: 'normal' is zero and points nowhere"},
      {kBall + "[[light]]\ntype = \"quad\"\ncorner = [0, 0, 0]\nradiance = 3",
       "scene.toml:5:1: a quad light needs corner, edge_u, edge_v (m), or else center, width, height (m), "
       "direction"},
      {kBall + "[[light]]\ntype = \"sun\"\nazimuth = 3",
       "scene.toml:5:1: a sun needs direction, or else azimuth and elevation (degrees)"},
  });
}

TEST_CASE("a scene without snow, or with snow that no particle fits into, is empty snow") {
  check_all({
      {"name = \"a\"", "scene.toml:1:1: empty snow: the scene has no [[snow]]"},
      {"[[snow]]\nshape = \"height_field\"\nfile = \"" FIRN_SOURCE_ROOT
       "/tests/scene/flat.asc\"\nextent = [1, 1, 1]\nbase = 2\n[simulation]\ndx = 0.1",
       "scene.toml:1:1: empty snow: no particle fits into 'snow0'; its shape is smaller than the particle "
       "spacing"},
  });
}

TEST_CASE("snow that starts inside other snow or a solid is refused, naming both, unless it is allowed") {
  const std::string ground = "[ground]\nheight = 0.5\n";
  const std::string other =
      "[[snow]]\nname = \"b\"\nshape = \"box\"\ncenter = [0, 0.5, 0]\nsize = [0.1, 0.1, 0.1]\n";
  const std::string stone =
      "[[collider]]\nname = \"stone\"\nshape = \"ball\"\ncenter = [0, 0.5, 0]\nradius = 0.05\n";
  CHECK_REFUSES(build_simulation(test::read(kBall + ground)),
                "scene.toml:3:1: snow 'snow0' starts inside the ground (");
  CHECK_REFUSES(build_simulation(test::read(kBall + other)),
                "scene.toml:8:1: snow 'b' starts inside snow 'snow0' (");
  CHECK_REFUSES(build_simulation(test::read(kBall + stone)),
                "scene.toml:3:1: snow 'snow0' starts inside collider 'stone' (");
  const std::string allow = "allow_overlap = true\n";
  CHECK_NOTHROW(build_simulation(test::read(kBall + allow + ground + other + allow + stone)));
}

TEST_CASE("all overlaps are told at once, the first eight by name, whichever axis the bodies stand along") {
  const auto row = [](int count, int axis) {
    std::string text;
    for (int i = 0; i < count; ++i) {
      Vec3 center(0.3, 1, -0.2);
      center[axis] += 0.15 * (i * 7 % count);  // not in order
      text += "[[snow]]\nshape = \"ball\"\nradius = 0.1\ncenter = [" + std::to_string(center[0]) + ", " +
              std::to_string(center[1]) + ", " + std::to_string(center[2]) + "]\n";
    }
    return text + "[simulation]\ndx = 0.04\n";
  };
  for (int axis = 0; axis < 3; ++axis) {
    const std::string three = test::refusal([&] { build_simulation(test::read(row(3, axis))); }).line;
    INFO(three);
    CHECK(three.find("snow 'snow1' starts inside snow 'snow0' (") != std::string::npos);
    CHECK(three.find("snow 'snow2' starts inside snow 'snow0' (") == std::string::npos);
    CHECK(three.find("snow 'snow2' starts inside snow 'snow1' (") != std::string::npos);
    CHECK(three.find("more") == std::string::npos);
    const std::string many = test::refusal([&] { build_simulation(test::read(row(20, axis))); }).line;
    INFO(many);
    CHECK(many.find(", and 11 more; move it") != std::string::npos);
  }
  std::string heap;  // 1770 pairs
  for (int i = 0; i < 60; ++i) heap += "[[snow]]\nshape = \"ball\"\nradius = 0.1\ncenter = [0, 1, 0]\n";
  const std::string counted =
      test::refusal([&] { build_simulation(test::read(heap + "[simulation]\ndx = 0.04\n")); }).line;
  INFO(counted);
  CHECK(counted.find(", and at least ") != std::string::npos);
}

TEST_CASE(
    "trimmed snow starts without what lies inside colliders and other snow, and each place is filled once") {
  const std::string body =
      "[[snow]]\nname = \"body\"\nshape = \"ball\"\nradius = 0.2\ncenter = [0, 0.15, 0]\n";
  const std::string head =
      "[[snow]]\nname = \"head\"\nshape = \"ball\"\nradius = 0.12\ncenter = [0, 0.4, 0]\n";
  const std::string rest = "[ground]\n[simulation]\ndx = 0.02\n", trimmed = "trim = true\n";
  const auto built = [&](const std::string& text) { return build_simulation(test::read(text + rest)); };
  CHECK_REFUSES(built(body + head), "set trim = true");
  CHECK_REFUSES(built(body + head + trimmed), "inside the ground");
  const auto count_in = [](const PlacedSnow& snow, const Vec3& center, double radius) {
    return std::count_if(snow.position.begin(), snow.position.end(),
                         [&](const Vec3& p) { return (p - center).norm() < radius; });
  };
  const Vec3 body_at(0, 0.15, 0), head_at(0, 0.4, 0);
  for (const bool head_first : {false, true}) {
    const std::string first = head_first ? head : body, second = head_first ? body : head;
    const SolverSetup both = built(first + trimmed + second + trimmed);
    const PlacedSnow &b = both.snow[head_first ? 1 : 0], &h = both.snow[head_first ? 0 : 1];
    CHECK(count_in(head_first ? b : h, head_first ? head_at : body_at, head_first ? 0.12 : 0.2) == 0);
    CHECK(count_in(head_first ? h : b, head_first ? body_at : head_at, head_first ? 0.2 : 0.12) > 50);
    for (const PlacedSnow* snow : {&b, &h}) {
      CHECK(snow->velocity.size() == snow->position.size());
      for (const Vec3& p : snow->position) REQUIRE(p.y() >= 0);
    }
    // A particle weighs what it weighed: what is left out is missing.
    const double spacing = particle_spacing(0.02, 8);
    CHECK(b.particle_volume == Approx(std::pow(spacing, 3)).epsilon(0.02));
  }
  // Snow that is not trimmed keeps all, wherever it stands.
  const SolverSetup one = built(head + trimmed + body + "allow_overlap = true\n");
  CHECK(count_in(one.snow[0], body_at, 0.2) == 0);
  CHECK(count_in(one.snow[1], head_at, 0.12) > 50);
  CHECK_REFUSES(
      built(body + trimmed +
            "[[snow]]\nname = \"seed\"\nshape = \"ball\"\nradius = 0.05\ncenter = [0, 0.2, 0]\n" + trimmed),
      "leaves nothing of it");
}

TEST_CASE("trimmed snow of uneven packing keeps the packing of what is left") {
  const std::string ball = kBall + "looseness = 0.3\nclump_size = 0.05\n";
  const std::string stone =
      "[[collider]]\nname = \"stone\"\nshape = \"ball\"\ncenter = [0, 0.55, 0]\nradius = "
      "0.05\n[simulation]\ndx = 0.02\n";
  const PlacedSnow whole = build_simulation(test::read(ball + "allow_overlap = true\n" + stone)).snow[0];
  const PlacedSnow left = build_simulation(test::read(ball + "trim = true\n" + stone)).snow[0];
  REQUIRE(left.packing.size() == left.position.size());
  CHECK(left.position.size() < whole.position.size());
  std::size_t found = 0;
  for (std::size_t i = 0, j = 0; i < whole.position.size() && j < left.position.size(); ++i) {
    if (whole.position[i] != left.position[j]) continue;
    found += whole.packing[i] == left.packing[j++];
  }
  CHECK(found == left.position.size());
}

TEST_CASE("a scene that is too fine for the machine is refused before a particle is placed") {
  for (const char* dx : {"1e-5", "1e-9", "1e-15"}) {
    INFO(dx);
    CHECK_REFUSES(build_simulation(test::read(kBall + "[simulation]\ndx = " + dx)), "scene.toml:6:1: dx = ");
    CHECK_REFUSES(build_simulation(test::read(kBall, {{"simulation.dx", dx}})), "GiB; this machine has");
  }
  CHECK_REFUSES(build_simulation(test::read(kBall + "[simulation]\nparticles_across = 100000")),
                "fewer particles across");
}

TEST_CASE("snow that only touches other snow and the ground is no overlap") {
  CHECK_NOTHROW(
      build_simulation(test::read("[[snow]]\nshape = \"box\"\ncenter = [0, 0.1, 0]\nsize = [0.4, 0.2, 0.4]\n"
                                  "[[snow]]\nshape = \"box\"\ncenter = [0, 0.3, 0]\nsize = [0.4, 0.2, "
                                  "0.4]\n[ground]\n[simulation]\ndx = 0.02")));
}

TEST_CASE("a fixed time step above the stable bound needs force") {
  const std::string text = kBall + "[simulation]\ndx = 0.01\ndt = 0.001";
  CHECK_REFUSES(build_simulation(test::read(text)),
                "scene.toml:7:1: dt = 0.001 s is above the stable bound 0.000304 s");
  CHECK(*build_simulation(test::read(text), true).fixed_dt == 0.001);
  CHECK(*build_simulation(test::read(kBall + "[simulation]\ndx = 0.01\ndt = 2e-4")).fixed_dt == 2e-4);
  CHECK_FALSE(build_simulation(test::read(kBall + "[simulation]\ndt = \"auto\"")).fixed_dt.has_value());
}

TEST_CASE("missing and damaged files are named together with the place that asks for them") {
  const test::TemporaryFolder folder;
  const std::string mesh = "[[snow]]\nshape = \"mesh\"\nfile = \"bunny.obj\"\n";
  const test::Refusal missing = test::refusal([&] { read_scene(folder.write("a.toml", mesh), {}); });
  CHECK(missing.line == folder.path("a.toml") + ":3:1: no such file: " + folder.path("bunny.obj"));
  CHECK(missing.code == ErrorCode::io);
  folder.write("bunny.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  CHECK_REFUSES(build_simulation(read_scene(folder.path("a.toml"), {})),
                "a.toml:3:1: " + folder.path("bunny.obj") + ": the mesh is not closed");
  const test::Refusal none = test::refusal([&] { read_scene(folder.path("none.toml"), {}); });
  CHECK(none.line == folder.path("none.toml") + ": cannot read: No such file or directory");
  CHECK(none.code == ErrorCode::io);
}

TEST_CASE("a syntax error is placed") {
  CHECK_REFUSES(test::read("[camera]\nfov = = 3"), "scene.toml:2:7: ");
  CHECK_REFUSES(test::read(kBall + "[time]\n[time]\n"), "scene.toml:6:1: ");
}

TEST_CASE("what other programs call otherwise is understood well enough to be told") {
  CHECK_REFUSES(test::read(ball_with("\"ball\"", "\"sphere\"")), "did you mean 'ball'?");
  CHECK_REFUSES(test::read(ball_with("\"ball\"", "\"Cube\"")), "did you mean 'box'?");
  CHECK_REFUSES(test::read(ball_with("\"ball\"", "\"terrain\"")), "did you mean 'height_field'?");
  CHECK_REFUSES(test::read(ball_with("center", "position")), "did you mean 'center'?");
  CHECK_REFUSES(test::read(kBall + "[camera]\nlookat = [0, 0, 0]"), "did you mean 'target'?");
  CHECK_REFUSES(test::read(kBall + "[camera]\nfrom = [0, 0, 0]"), "did you mean 'position'?");
  CHECK_REFUSES(test::read(kBall + "[image]\nspp = 4"), "did you mean 'samples'?");
  CHECK_REFUSES(test::read(kBall + "rho = 400"), "did you mean 'density'?");
  CHECK_REFUSES(test::read(kBall + std::string(10'000, 'x') + " = 400"), "unknown key");
}

TEST_CASE("lengths whose cubes no float holds are refused where they stand") {
  CHECK_REFUSES(test::read(kBall, {{"snow[0].radius", "2e12"}}), "to 1e+11");
  CHECK_REFUSES(test::read(kBall, {{"camera.position", "[0, 0, -2e12]"}}), "to 1e+11");
  CHECK(test::read(kBall, {{"snow[0].radius", "1e11"}}).snow[0].shape.radius == 1e11);
}

TEST_CASE("numbers that single precision cannot calculate with are refused where they stand, zero is not") {
  for (const char* number :
       {"1e300", "-1e300", "1e-300", "-1e-300", "1e39", "2e15", "1e-39", "5e-324", "9007199254740993000"}) {
    INFO(number);
    CHECK_REFUSES(test::read(kBall + "velocity = [0, " + number + ", 0]"), "scene.toml:5:");
    CHECK_REFUSES(test::read(kBall + "velocity = [0, " + number + ", 0]"), "single precision");
    CHECK_REFUSES(test::read(kBall + "[simulation]\ngravity = [0, " + number + ", 0]"), "scene.toml:6:");
    CHECK_REFUSES(test::read(kBall + "density = " + number), "'density'");
    CHECK_REFUSES(test::read(kBall, {{"snow.density", number}}), "--set snow.density");
  }
  CHECK(test::read(kBall + "velocity = [0, 0.0, -0.0]").snow[0].velocity.norm() == 0);
  CHECK(test::read(kBall + "velocity = [1e-15, 1e15, 0]").snow[0].velocity[1] == 1e15);
}

TEST_CASE("names are words of any script, and only UTF-8 gets into a scene's name from its file's") {
  CHECK(test::read(kBall + "name = \"Schneeb\u00E4lle\"").snow[0].name == "Schneeb\xC3\xA4lle");
  CHECK(test::read(kBall + "name = \"\u96EA_2\"", {{"snow.\xE9\x9B\xAA_2.radius", "0.3"}})
            .snow[0]
            .shape.radius == 0.3);
  for (const char* name : {"a b", "a/b", "a.b", "..", "a\\tb"}) {
    INFO(name);
    CHECK_REFUSES(test::read(kBall + "name = \"" + name + "\""), "cannot be a name");
  }
  CHECK(name_from_file("out/sch\xC3\xB6ner schnee.resolved.toml") == "sch\xC3\xB6ner_schnee");
  CHECK(name_from_file("sch\xF6n.toml") == "sch_n");
  CHECK(name_from_file(".toml") == "scene");
}

TEST_CASE("UTF-8 is told from what is none") {
  for (const char* text :
       {"", "a", "\xC3\xA4", "\xE9\x9B\xAA", "\xF0\x9F\x8F\x82", "\xEF\xBF\xBF", "\xF4\x8F\xBF\xBF"})
    CHECK(is_utf8(text));
  for (const char* text :
       {"\x80", "\xC3", "\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
        "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE9\x9B", "\xE9\x9B\x41", "\xFF"})
    CHECK_FALSE(is_utf8(text));
}

}  // namespace firn::test::error
