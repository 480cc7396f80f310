// SPDX-License-Identifier: MIT
#include "src/render/solids/objects.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "firn/error.h"
#include "src/render/solids/shape_rays.h"

namespace firn {

namespace {

// Seen from the side that the face's axis points to, upright for walls, with -z up for floors.
Vec3f texture_at(const Surface& look, const Vec3& local, Eigen::Index facing) {
  const double u = facing == 0 ? local.z() : local.x(), v = facing == 1 ? local.z() : -local.y();
  const double tall = look.texture_size * look.texture->height / look.texture->width;
  return look.texture->at(u / look.texture_size, v / tall, false);
}

Pose world_pose(const Object& object, double time, std::span<const DrivenCollider> driven) {
  const Pose& placed = object.shape.pose;
  for (const DrivenCollider& d : driven) {
    if (object.collider.empty() || d.name != object.collider) continue;
    const double late = time - d.time;
    return {rotation_by(late * vec(d.angular_velocity)) * mat(d.rotation) * placed.rotation,
            vec(d.position) + late * vec(d.velocity)};
  }
  return object.motion.pose(placed, time);
}

}  // namespace

ObjectSet::ObjectSet(const kernels::TraceKernels& kernels, std::vector<Object> objects,
                     std::vector<Surface> surfaces)
    : kernels_(kernels),
      objects_(std::move(objects)),
      surfaces_(std::move(surfaces)),
      triangles_(objects_.size()),
      world_pose_(objects_.size()),
      pose_(objects_.size()),
      room_(objects_.size()) {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i].surface < 0 || objects_[i].surface >= static_cast<int>(surfaces_.size())) {
      throw Error(ErrorCode::usage, "object " + std::to_string(i), "its surface does not exist");
    }
    const auto& form = objects_[i].shape.form;
    if (const auto* mesh = std::get_if<Mesh>(&form)) triangles_[i] = triangles_of(*mesh);
    if (const auto* field = std::get_if<HeightField>(&form)) triangles_[i] = triangles_of(*field);
  }
}

void ObjectSet::place(const Vec3& origin, double time, std::span<const DrivenCollider> driven) {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    world_pose_[i] = world_pose(objects_[i], time, driven);
    pose_[i] = world_pose_[i];
    pose_[i].translation -= origin;
    const Shape placed{objects_[i].shape.form, pose_[i]};
    Room& room = room_[i];
    if (std::holds_alternative<HalfSpace>(placed.form)) {
      const Vec3 normal = pose_[i].rotation.col(1);
      const double offset = normal.dot(pose_[i].translation);
      room.normal = normal.cast<float>();
      room.offset = static_cast<float>(offset + 1e-6 * (std::fabs(offset) + pose_[i].translation.norm()));
      continue;
    }
    const Bounds bounds = world_bounds(placed);
    const Vec3 margin = Vec3::Constant(1e-5 * (bounds.size().norm() + bounds.center().norm()));
    room = {(bounds.min - margin).cast<float>(), (bounds.max + margin).cast<float>(), Vec3f::Zero(), 0};
  }
}

Bounds ObjectSet::bounds(int object) const {
  const auto i = static_cast<std::size_t>(object);
  return world_bounds({objects_[i].shape.form, world_pose_[i]});
}

double ObjectSet::intersect(std::size_t object, const Vec3& o, const Vec3& d, double limit,
                            Vec3& normal) const {
  if (const auto& triangles = triangles_[object]) {
    std::int32_t met = -1;
    const double t = kernels_.mesh_closest(triangles->view(), o.data(), d.data(), limit, met);
    if (met >= 0) normal = triangles->normal(met);
    return t;
  }
  const auto& form = objects_[object].shape.form;
  if (const auto* ball = std::get_if<Ball>(&form)) return firn::intersect(*ball, o, d, limit, normal);
  if (const auto* box = std::get_if<Box>(&form)) return firn::intersect(*box, o, d, limit, normal);
  if (const auto* cylinder = std::get_if<Cylinder>(&form))
    return firn::intersect(*cylinder, o, d, limit, normal);
  if (const auto* capsule = std::get_if<Capsule>(&form))
    return firn::intersect(*capsule, o, d, limit, normal);
  return firn::intersect(std::get<HalfSpace>(form), o, d, limit, normal);
}

bool ObjectSet::blocks(std::size_t object, const Vec3& o, const Vec3& d, double limit) const {
  if (const auto& triangles = triangles_[object])
    return kernels_.mesh_occluded(triangles->view(), o.data(), d.data(), limit);
  Vec3 normal;
  return intersect(object, o, d, limit, normal) < limit;
}

std::shared_ptr<const SurfaceArea> ObjectSet::area(int object) const {
  return std::make_shared<SurfaceArea>(objects_[object].shape, triangles_[object]);
}

SurfacePoint ObjectSet::point(const ObjectHit& hit) const {
  const Surface& look = surface(hit.object);
  return {look.kind, hit.normal, hit.albedo, static_cast<float>(look.roughness),
          static_cast<float>(look.ior)};
}

// Patterns lie on the two axes of the shape's own frame that the surface faces least.
Vec3f ObjectSet::albedo_at(int object, const Vec3& local, const Vec3& normal) const {
  const Surface& look = surface(object);
  const bool checked = look.checker.minCoeff() >= 0 && look.checker_size > 0;
  if (!checked && !look.texture) return look.albedo;
  Eigen::Index facing = 0;
  normal.cwiseAbs().maxCoeff(&facing);
  if (look.texture) return texture_at(look, local, facing);
  double squares = 0;
  for (int a = 0; a < 3; ++a) squares += a == facing ? 0 : std::floor(local[a] / look.checker_size);
  return std::fmod(std::fabs(squares), 2) < 0.5 ? look.albedo : look.checker;
}

ObjectHit ObjectSet::closest(const Vec3f& o, const Vec3f& d, float reach) const {
  ObjectHit hit;
  double limit = reach;
  Vec3 normal, best_normal, best_local;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (room_[i].beyond(o, static_cast<float>(limit))) continue;
    const Mat3& rotation = pose_[i].rotation;
    const Vec3 local_o = rotation.transpose() * (o.cast<double>() - pose_[i].translation);
    const Vec3 local_d = rotation.transpose() * d.cast<double>();
    const double t = intersect(i, local_o, local_d, limit, normal);
    if (!(t < limit)) continue;
    limit = t;
    hit.object = static_cast<int>(i);
    best_normal = normal;
    best_local = local_o + t * local_d;
  }
  if (hit.object < 0) return hit;
  hit.t = static_cast<float>(limit);
  hit.normal = (pose_[hit.object].rotation * best_normal).cast<float>();
  hit.albedo = albedo_at(hit.object, best_local, best_normal);
  return hit;
}

bool ObjectSet::occluded(const Vec3f& o, const Vec3f& d, float reach) const {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (surfaces_[objects_[i].surface].kind == SurfaceKind::none || room_[i].beyond(o, reach)) continue;
    const Mat3& rotation = pose_[i].rotation;
    const Vec3 local_o = rotation.transpose() * (o.cast<double>() - pose_[i].translation);
    if (blocks(i, local_o, rotation.transpose() * d.cast<double>(), reach)) return true;
  }
  return false;
}

bool ObjectSet::may_reach(const Vec3f& low, const Vec3f& high) const {
  return !std::all_of(room_.begin(), room_.end(), [&](const Room& room) { return room.apart(low, high); });
}

}  // namespace firn
