// SPDX-License-Identifier: MIT
#include "src/mpm/thin_colliders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/geometry/mesh.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

constexpr double kThinCells = 2;
constexpr double kUnbounded = 1e300;
constexpr double kClearance = 1e-4;  // of the collider's thickness: particles are set down this far outside
// Cells that a particle is set back in one step: snow that a motion has squeezed deep into the collider comes
// out over some steps, and never leaves its block's margin unseen.
constexpr double kMostBack = 1;
constexpr int kMostSteps = 64;  // on the way to the surface; each goes as far as is free

struct Thickness {
  double operator()(const Ball& ball) const { return 2 * ball.radius; }
  double operator()(const Box& box) const { return 2 * box.half_size.minCoeff(); }
  double operator()(const Cylinder& c) const { return 2 * std::min(c.radius, c.half_height); }
  double operator()(const Capsule& c) const { return 2 * c.radius; }
  double operator()(const HalfSpace&) const { return kUnbounded; }
  double operator()(const HeightField&) const { return kUnbounded; }
  double operator()(const Mesh& mesh) const {
    double area = 0;
    const auto& vertices = mesh.mesh->vertices();
    for (const Triangle& t : mesh.mesh->triangles()) {
      const Vec3 &a = vertices[static_cast<std::size_t>(t[0])], &b = vertices[static_cast<std::size_t>(t[1])],
                 &c = vertices[static_cast<std::size_t>(t[2])];
      area += 0.5 * (b - a).cross(c - a).norm();
    }
    return area > 0 ? 2 * mesh.mesh->volume() / area : kUnbounded;
  }
};

}  // namespace

double thickness(const Shape& shape) { return std::visit(Thickness{}, shape.form); }

std::vector<std::size_t> find_thin(const std::vector<Collider>& colliders, double dx) {
  std::vector<std::size_t> thin;
  for (std::size_t k = 0; k < colliders.size(); ++k) {
    if (thickness(colliders[k].shape) < kThinCells * dx) thin.push_back(k);
  }
  return thin;
}

std::vector<ThinCollider> thin_colliders(const std::vector<Collider>& colliders,
                                         const std::vector<std::size_t>& thin, double begin, double end) {
  std::vector<ThinCollider> now;
  for (const std::size_t k : thin) {
    const Collider& c = colliders[k];
    ThinCollider t{&c, k, c.shape, c.shape, {}, {}};
    if (!c.motion.empty()) {
      t.before.pose = c.motion.pose(c.shape.pose, begin);
      t.after.pose = c.motion.pose(c.shape.pose, end);
      t.velocity = c.motion.velocity(begin, end);
    }
    t.bounds = world_bounds(t.before);
    t.bounds.include(world_bounds(t.after));
    now.push_back(t);
  }
  return now;
}

bool stop_at(const ThinCollider& thin, const Vec3& x, Vec3& y, Vec3& v) {
  // In the collider's own frame it stands still, and the particle goes straight from one place to another.
  const Shape still{thin.after.form, Pose{}};
  const Vec3 from = thin.before.pose.to_local(x), to = thin.after.pose.to_local(y);
  const double way = (to - from).norm(), clear = kClearance * thickness(still);
  SurfaceDistance surface = closest_surface(still, from);
  Vec3 met = from;
  if (surface.distance > 0) {
    double gone = 0;
    for (int k = 0; k < kMostSteps && surface.distance > clear; ++k) {
      gone += surface.distance;
      if (gone >= way) return false;
      met = from + (gone / way) * (to - from);
      surface = closest_surface(still, met);
    }
    if (surface.distance > clear) return false;  // it goes along the surface
    if ((to - met).dot(surface.normal) >= 0) return false;
  } else if (const SurfaceDistance out = closest_surface(still, to);
             out.distance > 0 && out.normal.dot(surface.normal) > 0) {
    return false;  // it leaves
  }
  // On the surface, and from there only along it: what it would have gone on aside.
  const Vec3 rest = to - met, aside = rest - surface.normal * rest.dot(surface.normal);
  Vec3 end = met + aside;
  const SurfaceDistance there = closest_surface(still, end);
  if (there.distance < clear) {
    const bool same_side = there.normal.dot(surface.normal) > 0;
    end = same_side ? Vec3(end + (clear - there.distance) * there.normal)
                    : Vec3(met + (clear - surface.distance) * surface.normal);
  }
  y = thin.after.pose.to_world(end);
  const Vec3 normal = thin.after.pose.rotation * surface.normal;
  const Vec3 relative = v - thin.velocity.at(y);
  const double inward = relative.dot(normal);
  if (thin.collider->contact == Contact::sticky) {
    v -= relative;
  } else if (inward < 0) {
    v -= inward * normal;
  }
  return true;
}

// After G2P: particles of awake blocks near thin colliders.
void Solver::State::stop_at_thin_colliders(double dt) {
  if (thin_indices.empty()) return;
  const std::vector<ThinCollider> thin = thin_colliders(setup.colliders, thin_indices, time, time + dt);
  const kernels::ParticleView p = particles.view();
  const std::vector<std::uint32_t>& awake = active.awake();
  std::vector<Impulse> impulses(awake.size() * thin.size());  // on the snow
  parallel_for(awake.size(), 1, [&](std::size_t n) {
    const BlockCoord& block = blocks.coord[awake[n]];
    const Vec3 margin = Vec3::Constant(3 * setup.dx);
    Bounds reach;  // of the block's particles, wherever they drifted
    reach.include(world_in_block(block, Vec3::Zero(), setup.dx) - margin);
    reach.include(world_in_block(block, Vec3::Constant(4.0), setup.dx) + margin);
    for (std::size_t k = 0; k < thin.size(); ++k) {
      const Bounds& its = thin[k].bounds;
      if ((its.min - reach.max).maxCoeff() > 0 || (reach.min - its.max).maxCoeff() > 0) continue;
      const kernels::ParticleRange range = range_of(awake[n]);
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const Vec3 cells = Vec3(p.x[0][i], p.x[1][i], p.x[2][i]) / kernels::kOneCell;
        const Vec3 moved(p.v[0][i], p.v[1][i], p.v[2][i]);
        Vec3 y = world_in_block(block, cells, setup.dx), v = moved;
        const Vec3 x = y - dt * moved, stopped_from = y;
        if (!stop_at(thin[k], x, y, v)) continue;
        Vec3 back = (y - stopped_from) / setup.dx;  // cells
        if (back.norm() > kMostBack) back *= kMostBack / back.norm();
        bool strayed = false;
        for (int axis = 0; axis < 3; ++axis) {
          p.x[axis][i] += static_cast<std::int32_t>(std::lround(back[axis] * kernels::kOneCell));
          p.v[axis][i] = static_cast<float>(v[axis]);
          strayed = strayed || p.x[axis][i] < -kernels::kOneCell || p.x[axis][i] >= 5 * kernels::kOneCell;
        }
        kernels::BlockSummary& told = summaries[awake[n]];
        told.strayed |= strayed;
        told.speed2 = std::max(told.speed2, static_cast<float>(v.squaredNorm()));
        impulses[n * thin.size() + k] += Impulse::at(y, p.m[i] * (v - moved));
      }
    }
  });
  for (std::size_t n = 0; n < awake.size(); ++n) {
    for (std::size_t k = 0; k < thin.size(); ++k)
      forces.impulse[thin[k].index] += impulses[n * thin.size() + k];
  }
}

}  // namespace firn
