// SPDX-License-Identifier: MIT
// Pictures that a program takes of its own snow.
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/folder.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::renderer {
namespace {

using Catch::Matchers::Contains;

Scene seen(Scene scene, int samples = 4) {
  scene.set("camera.position", {0.5, 0.5, 0.9}).set("camera.target", {0, 0.12, 0});
  return scene.set("image.width", 48).set("image.height", 36).set("image.samples", samples);
}

RendererOptions with(int threads) {
  RendererOptions options;
  options.threads = threads;
  return options;
}

std::vector<float> read_pfm(const std::string& file, int values) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  std::vector<float> pixels(static_cast<std::size_t>(values));
  REQUIRE(bytes.size() > pixels.size() * sizeof(float));
  std::copy_n(bytes.end() - static_cast<std::ptrdiff_t>(pixels.size() * sizeof(float)),
              pixels.size() * sizeof(float), reinterpret_cast<char*>(pixels.data()));
  return pixels;
}

// PFM has the bottom row first.
std::vector<float> upside_down(const std::vector<float>& rgb, int width) {
  std::vector<float> out;
  const auto row = static_cast<std::ptrdiff_t>(3 * width);
  for (auto end = rgb.end(); end != rgb.begin(); end -= row) out.insert(out.end(), end - row, end);
  return out;
}

const std::vector<float>& layer(const Picture& picture, Layer wanted) {
  for (const LayerImage& l : picture.layers) {
    if (l.layer == wanted) return l.values;
  }
  FAIL("no such layer");
  return picture.rgb;
}

// The share of pixels whose depths differ by more than a millimetre.
double apart(const Picture& a, const Picture& b) {
  const std::vector<float>&x = layer(a, Layer::depth), &y = layer(b, Layer::depth);
  std::size_t count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) count += !(x[i] == y[i] || std::fabs(x[i] - y[i]) < 1e-3);
  return static_cast<double>(count) / static_cast<double>(x.size());
}

}  // namespace

TEST_CASE("a picture of a snapshot is that of the frame of a session, on any number of threads") {
  for (const char* integrator : {"path", "bidirectional", "preview"}) {
    Scene scene = seen(bed());
    scene.set("image.integrator", integrator).set("time.frames", 3).set("time.fps", 100);
    scene.set("output.formats", Value::Array{"pfm"}).set("output.movie", false);
    const Folder folder;
    SessionOptions options;
    options.out = folder / "run";
    Session::start(scene, options).run();
    for (const int threads : {1, 2, 3}) {
      Simulation simulation(scene, on(threads));
      Renderer renderer(scene, with(threads));
      Picture picture;
      for (int frame = 0; frame < 3; ++frame) {
        simulation.advance_to(scene.frame_time(frame));
        Snapshot snow = simulation.snapshot();
        snow.frame = frame;
        REQUIRE(renderer.render(snow, picture));
        REQUIRE(picture.width == 48);
        REQUIRE(picture.rgb.size() == 3 * 48 * 36);
        const std::string file = folder / ("run/frames/000" + std::to_string(frame) + ".pfm");
        CHECK(upside_down(picture.rgb, 48) == read_pfm(file, 3 * 48 * 36));
      }
    }
  }
}

TEST_CASE("a picture shows a driven collider where it is, moved and turned") {
  struct Way {
    Vector3 linear, angular;
  };
  for (const Way& way :
       {Way{{-0.5, 0, 0}, {}}, Way{{0, 0, 0}, {0, 3, 0}}, Way{{-0.4, 0.3, 0.2}, {2, -1, 4}}}) {
    for (const double shutter : {0.0, 1e-4}) {
      const auto scene_at = [&](bool at_end) {
        Scene scene = seen(with_plate(20), 1);
        scene.set("output.layers", Value::Array{"depth"}).set("camera.shutter", shutter);
        if (!at_end) return scene;
        // The same motion, written as key frames.
        constexpr double kSeconds = 0.1, kDegrees = 180 / 3.14159265358979323846;
        const Vector3 &v = way.linear, &w = way.angular;
        const double speed = std::hypot(w[0], w[1], w[2]), turn = kSeconds * speed * kDegrees;
        // One axis at a time is what angles about x, y and z can say alone.
        if (std::count(w.begin(), w.end(), 0.0) < 2) return scene;
        const double sign = w[0] + w[1] + w[2] < 0 ? -1 : 1;
        Value::Array angles;
        for (const double x : w) angles.emplace_back(x != 0 ? sign * turn : 0.0);
        const Table first = {{"time", 0.0}, {"position", {0, 0, 0}}};
        const Table last = {{"time", kSeconds},
                            {"position", {kSeconds * v[0], kSeconds * v[1], kSeconds * v[2]}},
                            {"rotation", Value(angles)}};
        scene.set("collider[0].motion", Value::Array{Value(first), Value(last)});
        return scene;
      };
      Simulation driven(scene_at(false));
      driven.drive("plate", [&](const DrivenCollider&) { return ColliderVelocity{way.linear, way.angular}; });
      driven.advance_to(0.1);
      const Snapshot snow = driven.snapshot();
      REQUIRE(snow.driven.size() == 1);
      CHECK(snow.driven[0].name == "plate");
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(snow.driven[0].position[k] ==
              Approx(Vector3{-0.2, 0.2, 0}[k] + 0.1 * way.linear[k]).margin(1e-9));
      Renderer renderer(driven.scene());
      const Picture picture = renderer.render(snow);
      Snapshot as_put = snow;
      as_put.driven.clear();
      CHECK(apart(picture, renderer.render(as_put)) > 0.02);
      if (std::count(way.angular.begin(), way.angular.end(), 0.0) < 2) continue;
      Snapshot same = snow;
      same.driven.clear();
      CHECK(apart(picture, Renderer(scene_at(true)).render(same)) < 0.002);
    }
  }
}

TEST_CASE("a driven ground and a driven lamp are seen where they are") {
  Scene scene = seen(bed(), 1);
  scene.set("output.layers", Value::Array{"depth"});
  Simulation simulation(scene);
  simulation.drive("ground", [](const DrivenCollider&) { return ColliderVelocity{{0, -1, 0}, {}}; });
  simulation.advance_to(0.05);
  Scene lower = seen(bed(), 1);
  lower.set("output.layers", Value::Array{"depth"}).set("ground.height", -0.05);
  Snapshot snow = simulation.snapshot();
  const Picture picture = Renderer(scene).render(snow);
  snow.driven.clear();
  CHECK(apart(picture, Renderer(lower).render(snow)) < 0.002);
  CHECK(apart(picture, Renderer(scene).render(snow)) > 0.2);
}

TEST_CASE("a renderer refuses what its scene does not know and what is no snow") {
  const Scene scene = seen(with_plate());
  Simulation simulation(scene);
  Renderer renderer(scene);
  SECTION("snow that was added since") {
    simulation.add_snow(kBall);
    const Error error = refusal([&] { renderer.render(simulation.snapshot()); });
    CHECK(error.code() == ErrorCode::usage);
    CHECK_THAT(error.what(), Contains("snow number 1") && Contains("'bed'") && Contains("scene()"));
    CHECK_NOTHROW(Renderer(simulation.scene()).render(simulation.snapshot()));
  }
  SECTION("another scene's collider") {
    simulation.drive("plate", [](const DrivenCollider&) { return ColliderVelocity{}; });
    const Error error = refusal([&] { Renderer(seen(bed())).render(simulation.snapshot()); });
    CHECK_THAT(error.what(), Contains("'plate'") && Contains("ground"));
  }
  SECTION("a collider that is nowhere") {
    simulation.drive("plate", [](const DrivenCollider&) { return ColliderVelocity{}; });
    Snapshot snow = simulation.snapshot();
    snow.driven[0].position[1] = NAN;
    CHECK_THAT(refusal([&] { renderer.render(snow); }).what(), Contains("'plate'") && Contains("finite"));
    for (const Matrix3& wrong :
         {Matrix3{}, Matrix3{2, 0, 0, 0, 2, 0, 0, 0, 2}, Matrix3{-1, 0, 0, 0, 1, 0, 0, 0, 1}}) {
      snow = simulation.snapshot();
      snow.driven[0].rotation = wrong;
      CHECK_THAT(refusal([&] { renderer.render(snow); }).what(), Contains("no rotation matrix"));
    }
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        snow = simulation.snapshot();
        snow.origin[axis] = bad;
        CHECK_THAT(refusal([&] { renderer.render(snow); }).what(), Contains("origin"));
      }
    }
  }
  SECTION("values that no snow has") {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, inf, -inf}) {
      Snapshot snow = simulation.snapshot();
      snow.density[7] = bad;
      CHECK_THAT(refusal([&] { renderer.render(snow); }).what(),
                 Contains("particle 7") && Contains("density"));
      snow = simulation.snapshot();
      snow.volume0[3] = bad;
      CHECK_THAT(refusal([&] { renderer.render(snow); }).what(),
                 Contains("particle 3") && Contains("volume0"));
      snow = simulation.snapshot();
      snow.velocity[1][5] = bad;
      CHECK_THAT(refusal([&] { renderer.render(snow); }).what(),
                 Contains("particle 5") && Contains("velocity"));
      snow = simulation.snapshot();
      snow.position[2][2] = bad;
      CHECK(refusal([&] { renderer.render(snow); }).code() == ErrorCode::unstable);
    }
    for (const float bad : {0.f, -1.f}) {
      Snapshot snow = simulation.snapshot();
      snow.density[0] = bad;
      CHECK(refusal([&] { renderer.render(snow); }).code() == ErrorCode::unstable);
      snow = simulation.snapshot();
      snow.volume0[0] = bad;
      CHECK(refusal([&] { renderer.render(snow); }).code() == ErrorCode::unstable);
    }
    CHECK_NOTHROW(renderer.render(simulation.snapshot()));  // and goes on afterwards
  }
}

TEST_CASE("a picture is stopped, and the next one is whole") {
  Scene scene = seen(bed(), 100000);
  scene.set("image.width", 400).set("image.height", 400);
  const Snapshot snow = Simulation(scene).snapshot();
  Renderer renderer(scene);
  for (const int milliseconds : {0, 300}) {
    std::stop_source stop;
    std::jthread later([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
      stop.request_stop();
    });
    CHECK(refusal([&] { renderer.render(snow, stop.get_token()); }).code() == ErrorCode::interrupted);
    Picture picture;
    CHECK_FALSE(renderer.render(snow, picture, stop.get_token()));
  }
}

TEST_CASE("a snapshot without particles and an empty renderer's scene give the scenery alone") {
  const Scene scene = seen(bed());
  Simulation simulation(scene);
  const Snapshot all = simulation.snapshot();
  simulation.remove_snow({all.id.data(), all.size()});
  const Picture bare = Renderer(scene).render(simulation.snapshot());
  const Picture snowy = Renderer(scene).render(all);
  CHECK(bare.rgb != snowy.rgb);
  for (const float value : bare.rgb) REQUIRE(std::isfinite(value));
  CHECK(Renderer(scene).render(Snapshot{}).rgb == bare.rgb);
}

TEST_CASE("pictures are written as their names end") {
  Scene scene = seen(bed());
  scene.set("output.layers", Value::Array{"depth", "albedo"}).set("output.exposure", -1);
  Renderer renderer(scene);
  CHECK(renderer.tone_mapping().exposure == -1);
  // A run keeps files alone.
  CHECK_THAT(refusal([&] { Session::start(scene); }).what(),
             Contains("test_renderer.cpp:") && Contains("png and ppm hold the beauty alone: add \"pfm\""));
  const Picture picture = renderer.render(Simulation(scene).snapshot());
  const Folder folder;
  CHECK(write_picture(picture, folder / "a.PFM") ==
        std::vector<std::string>{folder / "a.PFM", folder / "a.depth.pfm", folder / "a.albedo.pfm"});
  CHECK(read_pfm(folder / "a.PFM", 3 * 48 * 36) == upside_down(picture.rgb, 48));
  CHECK(write_picture(picture, folder / "b.png").size() == 1);
  CHECK(write_picture(picture, folder / "b.c.ppm", renderer.tone_mapping()).size() == 1);
  const std::vector<std::uint8_t> bright = tone_mapped(picture),
                                  dark = tone_mapped(picture, {-3, ToneMap::soft});
  CHECK(bright.size() == picture.rgb.size());
  CHECK(std::equal(bright.begin(), bright.end(), dark.begin(), std::greater_equal<>()));
  for (const char* name : {"x", "x.jpg", ".png", "x.png.gz"})
    CHECK_THAT(refusal([&] { write_picture(picture, folder / name); }).what(), Contains(".pfm or .exr"));
  // A link is followed, and a device is left alone.
  std::filesystem::create_symlink("b.png", folder / "link.png");
  CHECK(write_picture(picture, folder / "link.png").size() == 1);
  CHECK(std::filesystem::is_symlink(folder / "link.png"));
  REQUIRE(::mkfifo((folder / "pipe.png").c_str(), 0600) == 0);
  CHECK_THAT(refusal([&] { write_picture(picture, folder / "pipe.png"); }).what(),
             Contains("no regular file"));
  CHECK(std::filesystem::is_fifo(folder / "pipe.png"));
  CHECK(refusal([&] { write_picture(picture, folder / "none/x.png"); }).code() == ErrorCode::io);
  CHECK(refusal([&] { write_picture({}, folder / "x.png"); }).code() == ErrorCode::usage);
  Picture wrong = picture;
  wrong.width = 47;
  CHECK_THAT(refusal([&] { write_picture(wrong, folder / "x.png"); }).what(), Contains("47 x 36"));
  wrong = picture;
  wrong.layers[0].values.pop_back();
  CHECK_THAT(refusal([&] { write_picture(wrong, folder / "x.pfm"); }).what(), Contains("depth"));
  CHECK(refusal([&] { tone_mapped(picture, {std::nan(""), ToneMap::soft}); }).code() == ErrorCode::usage);
}

}  // namespace firn::test::renderer
