// SPDX-License-Identifier: MIT
// In: what a program wants of a collider now. Out: a motion of two key frames for the coming step, so that
// everything else sees one more collider that moves.
#include "src/mpm/driven.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "firn/error.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

constexpr double kMostTurn = 1;  // rad, in a step: between key frames a collider turns the short way

MotionKey key_at(const Collider& collider, double time) {
  const Vec3 pivot = collider.shape.pose.translation;
  const Pose pose = collider.motion.pose({Mat3::Identity(), pivot}, time);
  return {time, pose.translation - pivot, pose.rotation};
}

DrivenCollider as_told(const Solver::State& s, const Driven& d, const MotionKey& now) {
  const auto& frame = s.setup.frame;
  const Collider& collider = s.setup.colliders[d.collider];
  const Vec3 pivot = collider.shape.pose.translation + now.shift;
  const Mat3 to_world = frame ? frame->rotation : Mat3(Mat3::Identity());
  DrivenCollider out;
  out.name = collider.name;
  out.time = s.time;
  out.position = array_of(point_in_world(frame, pivot));
  out.rotation = rows_of(frame ? Mat3(to_world * now.rotation * to_world.transpose()) : now.rotation);
  out.velocity = array_of(vector_in_world(frame, vec(d.velocity.linear)));
  out.angular_velocity = array_of(vector_in_world(frame, vec(d.velocity.angular)));
  out.dt = d.dt;
  if (d.dt > 0) {
    out.force = array_of(vector_in_world(frame, -d.last.linear / d.dt));
    out.torque = array_of(vector_in_world(frame, -d.last.moment_about(pivot) / d.dt));
  }
  return out;
}

[[noreturn]] void refuse_driver(const Solver::State& s, const Driven& d, const std::string& what) {
  throw Error(ErrorCode::usage, "",
              "the driver of collider '" + s.setup.colliders[d.collider].name + "' " + what);
}

// The velocity that a program wants, in the simulation's frame.
ColliderVelocity answer_of(const Solver::State& s, const Driven& d, const MotionKey& now) {
  if (!d.driver) {
    throw Error(ErrorCode::usage, "",
                "collider '" + s.setup.colliders[d.collider].name +
                    "' was driven when this state was saved: give its driver again before going on");
  }
  const ColliderVelocity wanted = d.driver(as_told(s, d, now));
  const Vec3 linear = vec(wanted.linear), angular = vec(wanted.angular);
  if (!linear.allFinite() || !angular.allFinite())
    refuse_driver(s, d, "returned a velocity that is not finite");
  const Mat3 to_local = s.setup.frame ? Mat3(s.setup.frame->rotation.transpose()) : Mat3(Mat3::Identity());
  return {array_of(to_local * linear), array_of(to_local * angular)};
}

// Where that leads, later than any step will end: a step is at most half as long.
MotionKey key_after(const Solver::State& s, const Driven& d, const MotionKey& now,
                    const ColliderVelocity& velocity) {
  const double longest = s.setup.fixed_dt.value_or(s.setup.max_dt);  // s
  const Vec3 linear = vec(velocity.linear), angular = vec(velocity.angular);
  if (s.setup.fixed_dt && angular.norm() * longest > kMostTurn)
    refuse_driver(s, d, "turns it by more than 1 rad in a step of the fixed dt");
  const double seconds = std::min(2 * longest, 2 * kMostTurn / angular.norm());
  if (!(s.time + seconds > s.time)) refuse_driver(s, d, "turns it faster than any step can follow");
  return {s.time + seconds, now.shift + seconds * linear, rotation_by(seconds * angular) * now.rotation};
}

}  // namespace

bool is_driven(const Solver::State& state, std::size_t collider) {
  return std::any_of(state.driven.begin(), state.driven.end(),
                     [&](const Driven& d) { return d.collider == collider; });
}

std::vector<DrivenCollider> driven_now(const Solver::State& state) {
  std::vector<const Driven*> all;
  for (const Driven& d : state.driven) all.push_back(&d);
  std::sort(all.begin(), all.end(),
            [](const Driven* a, const Driven* b) { return a->collider < b->collider; });
  std::vector<DrivenCollider> out;
  for (const Driven* d : all)
    out.push_back(as_told(state, *d, key_at(state.setup.colliders[d->collider], state.time)));
  return out;
}

void Solver::State::require_idle() const {
  if (!asking) return;
  throw Error(ErrorCode::usage, "",
              "a driver may look at its simulation, but not step it, change it or give it other drivers");
}

// Nothing changes until all have answered.
void Solver::State::ask_drivers() {
  struct Answer {
    ColliderVelocity velocity;
    MotionKey begin, end;
  };
  std::vector<Answer> answers;
  asking = true;
  try {
    for (const Driven& d : driven) {
      const MotionKey now = key_at(setup.colliders[d.collider], time);
      const ColliderVelocity velocity = answer_of(*this, d, now);
      answers.push_back({velocity, now, key_after(*this, d, now, velocity)});
    }
  } catch (...) {
    asking = false;
    throw;
  }
  asking = false;
  for (std::size_t k = 0; k < driven.size(); ++k) {
    Driven& d = driven[k];
    Collider& collider = setup.colliders[d.collider];
    d.velocity = answers[k].velocity;
    d.begin = answers[k].begin;
    d.end = answers[k].end;
    collider.motion = Motion({d.begin, d.end}, collider.shape.pose.translation);
  }
}

void Solver::State::note_driven(double dt) {
  for (Driven& d : driven) {
    const Collider& collider = setup.colliders[d.collider];
    d.dt = dt;
    d.last = forces.impulse[d.collider] - d.before;
    d.longest_way += way_where_snow_is(collider, reach, time, time + dt);
    d.top_speed = std::max(d.top_speed, speed_where_snow_is(collider, reach, time, time + dt));
  }
}

void Solver::drive(std::size_t index, ColliderDriver driver) {
  State& s = *state_;
  s.require_idle();
  for (Driven& d : s.driven) {
    if (d.collider == index) {
      d.driver = std::move(driver);
      return;
    }
  }
  Collider& collider = s.setup.colliders.at(index);
  if (!collider.motion.empty()) {
    throw Error(ErrorCode::usage, "",
                "collider '" + collider.name + "' has a motion of its own, so that it cannot be driven");
  }
  Driven d{index, std::move(driver), {}, {}, {}, 0, {}, {}, 0, 0};
  d.begin = d.end = {s.time, Vec3::Zero(), Mat3::Identity()};
  collider.motion = Motion({d.begin}, collider.shape.pose.translation);
  s.driven.push_back(std::move(d));
  s.grid.forget_contacts();
  const kernels::BlockSummary seen = s.summary;
  s.rebuild_grid();
  s.summary = seen;
}

}  // namespace firn
