// SPDX-License-Identifier: MIT
// Motions by key frames: poses, velocities, and how a scene states them.
#include <Eigen/Geometry>

#include "src/geometry/keyframes.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"

namespace firn::test::keyframes {

namespace {

const Vec3 kPivot(0.5, 0.2, -0.1);

Mat3 turned(double radians, const Vec3& axis) {
  return Eigen::AngleAxisd(radians, axis.normalized()).toRotationMatrix();
}

Motion some_motion() {
  return {{{1, Vec3::Zero(), Mat3::Identity()},
           {3, Vec3(2, -1, 0.5), turned(0.8, Vec3(1, 2, 3))},
           {4, Vec3(2, 0, 0), turned(1.9, Vec3(1, 2, 3))}},
          kPivot};
}

Pose placed() { return {turned(0.4, Vec3(0, 1, 1)), Vec3(1, 0, 0)}; }

}  // namespace

TEST_CASE("a motion stands before its first and after its last key and goes evenly between them") {
  const Motion motion = some_motion();
  CHECK((motion.pose(placed(), 0).translation - placed().translation).norm() < 1e-12);
  CHECK((motion.pose(placed(), 1).rotation - placed().rotation).norm() < 1e-12);
  const Pose half = motion.pose(placed(), 2);
  const Mat3 turn = turned(0.4, Vec3(1, 2, 3));
  CHECK((half.rotation - turn * placed().rotation).norm() < 1e-12);
  CHECK((half.translation - (kPivot + Vec3(1, -0.5, 0.25) + turn * (Vec3(1, 0, 0) - kPivot))).norm() < 1e-12);
  const Pose last = motion.pose(placed(), 4), later = motion.pose(placed(), 400);
  CHECK((last.translation - later.translation).norm() == 0);
  CHECK((last.rotation - turned(1.9, Vec3(1, 2, 3)) * placed().rotation).norm() < 1e-12);
}

TEST_CASE("a motion seen from another frame leads to the same places in the world") {
  const Pose frame{turned(-1.1, Vec3(1, -2, 0.5)), Vec3(4, -3, 2)};
  const Motion seen = some_motion().seen_from(frame);
  for (const double time : {0.0, 1.7, 3.0, 3.6, 9.0}) {
    const Pose expected = some_motion().pose(placed(), time);
    const Pose local = seen.pose(frame.to_local(placed()), time);
    CHECK((frame.to_world(local.translation) - expected.translation).norm() < 1e-12);
    CHECK((frame.rotation * local.rotation - expected.rotation).norm() < 1e-12);
  }
  CHECK(Motion{}.seen_from(frame).empty());
}

TEST_CASE("the velocity of a motion is what its pose changes by") {
  const Motion motion = some_motion();
  const Vec3 point(0.3, -0.2, 0.7);  // of the body
  for (const double time : {0.5, 1.5, 2.7, 3.4, 5.0}) {
    const double h = 1e-6;
    const Vec3 before = motion.pose(placed(), time - h).to_world(point);
    const Vec3 after = motion.pose(placed(), time + h).to_world(point);
    const Vec3 expected = (after - before) / (2 * h);
    CHECK((motion.velocity(time - h, time + h).at(after) - expected).norm() < 1e-5);
  }
  CHECK(motion.velocity(0, 1).is_zero());
  CHECK(motion.velocity(4, 5).is_zero());
  // Across keys: the mean, which leads from the pose before to the pose after.
  const RigidVelocity mean = motion.velocity(0, 3.5);
  CHECK((3.5 * mean.linear - Vec3(2, -0.5, 0.25)).norm() < 1e-12);
  CHECK(3.5 * mean.angular.norm() == Approx(1.35));
}

TEST_CASE("no point of a body is faster than its motion says, nor goes a longer way") {
  const Motion motion = some_motion();
  const Shape box{Box{Vec3(0.2, 0.3, 0.4)}, placed()};
  const double lever = motion.lever(box);
  double fastest = 0, way = 0;
  const Vec3 corner(0.2, 0.3, 0.4);
  for (double t = 0; t < 5; t += 0.01) {
    const double step =
        (motion.pose(placed(), t + 0.01).to_world(corner) - motion.pose(placed(), t).to_world(corner)).norm();
    fastest = std::max(fastest, step / 0.01);
    way += step;
  }
  CHECK(fastest > 1);
  CHECK(fastest <= motion.top_speed(0, 5, lever));
  CHECK(way <= motion.longest_way(0, 5, lever));
  CHECK(motion.top_speed(4, 5, lever) == 0);
}

TEST_CASE("a scene states a motion as key frames, and resolves and reads back to the same") {
  const std::string plate =
      "[[collider]]\nshape = \"box\"\ncenter = [0, -3, 0]\nsize = [1, 1, 1]\n"
      "motion = [{time = 0.5}, {time = 1, position = [0, 0.2, 0], rotation = [0, 0, 90]}]\n";
  const SceneConfig scene = read(kBall + plate + "pivot = [1, -3, 0]\n");
  REQUIRE(scene.colliders[0].motion->size() == 2);
  const Collider collider = build_simulation(scene).colliders[0];
  const Pose end = collider.motion.pose(collider.shape.pose, 2);
  CHECK((end.translation - Vec3(1, -3.8, 0)).norm() < 1e-9);
  CHECK(build_render(scene).objects[0].motion.pose(collider.shape.pose, 2).translation == end.translation);
  const std::string resolved = resolved_toml(scene);
  CHECK(resolved_toml(read(resolved)) == resolved);
  CHECK(resolved.find("motion = [{time = 0.5, position = [0.0, 0.0, 0.0]") != std::string::npos);
  CHECK(resolved_toml(read(kBall)).find("motion =") == std::string::npos);
}

TEST_CASE("a motion that makes no sense is refused where it is written") {
  const std::string plate = "[[collider]]\nshape = \"box\"\ncenter = [0, -3, 0]\nsize = [1, 1, 1]\n";
  const auto with = [&](const std::string& line) { return kBall + plate + line; };
  CHECK_REFUSES(read(with("motion = []")), "scene.toml:9:10: 'motion': expected a list of {time");
  CHECK_REFUSES(read(with("motion = [{position = [0, 1, 0]}]")),
                "a key frame of 'motion' lacks 'time', in seconds");
  CHECK_REFUSES(read(with("motion = [{time = -1}]")),
                "'time' is -1.0, out of range: it must be at least 0 s");
  CHECK_REFUSES(read(with("motion = [{time = 0, positon = [0, 1, 0]}]")),
                "unknown key 'positon' in 'motion', did you mean 'position'?");
  CHECK_REFUSES(read(with("motion = [{time = 1}, {time = 1}]")), "the times of the key frames do not ascend");
  CHECK_REFUSES(read(with("motion = [{time = 0}, {time = 1, rotation = [0, 360, 0]}]")),
                "scene.toml:9:1: 'motion' turns by half a turn or more between two key frames");
  CHECK_REFUSES(read(with("pivot = [0, 1, 0]")), "scene.toml:9:1: 'pivot' is given, but no 'motion'");
}

TEST_CASE("a collider is where its motion begins when snow is placed") {
  const std::string stone =
      "[[collider]]\nname = \"stone\"\nshape = \"ball\"\ncenter = [0, 3, 0]\nradius = 0.05\n"
      "motion = [{time = 0, position = [0, -2.5, 0]}, {time = 1}]\n";
  CHECK_REFUSES(build_simulation(read(kBall + stone)), "snow 'snow0' starts inside collider 'stone' (");
}

TEST_CASE(
    "a scene states the camera's way, lens, shutter and film, and resolves and reads back to the same") {
  const std::string text =
      kBall +
      "[time]\nfps = 25\nspeed = 0.5\n"
      "[camera]\naperture = 0.01\nfocus = 2\nshutter = 0.5\n"
      "motion = [{time = 0, position = [0, 1, 4], target = [0, 0, 0]}, "
      "{time = 2, position = [2, 1, 4], target = [0, 0.5, 0]}]\n"
      "[image]\nfilter = \"blackman_harris\"\nfilter_width = 3.5\nnoise = 0.05\n"
      "[output]\nformats = [\"pfm\"]\nlayers = [\"beauty\", \"depth\"]\ndenoise = true\n";
  const SceneConfig scene = read(text);
  const RenderSetup setup = build_render(scene);
  CHECK(setup.camera.motion->at(1).target == Vec3(0, 0.5, 0));
  CHECK(setup.camera.focus == 2.0);
  CHECK(setup.frame_seconds == Approx(0.02));
  CHECK(setup.image.filter == FilterKind::blackman_harris);
  CHECK(setup.layers == std::vector<Layer>{Layer::beauty, Layer::depth});
  CHECK(setup.denoise);
  const std::string resolved = resolved_toml(scene);
  CHECK(resolved_toml(read(resolved)) == resolved);
}

TEST_CASE("a camera or an output that makes no sense is refused where it is written") {
  const auto camera = [](const std::string& line) { return kBall + "[camera]\n" + line; };
  CHECK_REFUSES(read(camera("motion = [{time = 0, position = [0, 1, 4]}]")),
                "a key frame of 'motion' lacks 'target', 3 numbers (m)");
  CHECK_REFUSES(read(camera("motion = [{time = 0, position = [0, 1, 4], target = [0, 1, 4]}]")),
                "scene.toml:6:1: at a key frame of 'motion' the camera is at its target");
  CHECK_REFUSES(read(camera("motion = [{time = 0, rotation = [0, 0, 0]}]")),
                "unknown key 'rotation' in 'motion'");
  CHECK_REFUSES(read(camera("focus = 2")), "scene.toml:6:1: 'focus' is given, but no 'aperture'");
  CHECK_REFUSES(read(camera("shutter = 1.5")), "'shutter' is 1.5, out of range");
  CHECK_REFUSES(read(camera("aperture = -1")), "'aperture' is -1.0, out of range");
}

}  // namespace firn::test::keyframes
