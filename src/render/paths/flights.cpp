// SPDX-License-Identifier: MIT
#include "src/render/paths/flights.h"

namespace firn {
namespace {

constexpr std::uint64_t kOtherMedia = 0x6d656469612e2e2eull;  // a stream of random numbers of their own

}  // namespace

void Flights::find_surface(RayStream& rays, bool coherent) const {
  if (world_.grid.size() == 0) return;
  const kernels::TraceKernels& with = world_.kernels;
  if (world_.image.snow == SnowShape::smooth) {
    const auto closest = coherent ? with.surface_closest_coherent : with.surface_closest;
    closest(world_.field.view(), world_.field.surface(), rays.view(), 0, rays.size());
  } else {
    const auto closest = coherent ? with.closest_coherent : with.closest;
    closest(world_.grid.view(), rays.view(), 0, rays.size());
  }
}

void Flights::find_objects(RayStream& rays, std::vector<ObjectHit>& objects) const {
  objects.assign(rays.size(), {});
  if (world_.objects.empty()) return;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    objects[i] = world_.objects.closest(rays.origin(i), rays.direction(i), rays.t(i));
    if (objects[i].object >= 0) rays.t(i) = objects[i].t;
  }
}

void Flights::find(RayStream& rays, bool coherent, std::vector<ObjectHit>& objects) const {
  find_surface(rays, coherent);  // most rays that meet it need no object
  find_objects(rays, objects);
}

void Flights::find_shadow(RayStream& rays, bool coherent) const {
  if (world_.grid.size() == 0) return;
  const kernels::TraceKernels& with = world_.kernels;
  if (world_.image.snow == SnowShape::smooth) {
    const auto occluded = coherent ? with.surface_occluded_coherent : with.surface_occluded;
    occluded(world_.field.view(), world_.field.surface(), rays.view(), 0, rays.size());
  } else {
    const auto occluded = coherent ? with.occluded_coherent : with.occluded;
    occluded(world_.grid.view(), rays.view(), 0, rays.size());
  }
}

void Flights::fly(RayStream& rays, const RayMarks& marks, bool first, std::vector<Arrival>& arrivals,
                  LitCollisions& lit) {
  const std::size_t count = rays.size();
  arrivals.resize(count);
  lit.clear(0);
  // Most flights end in snow after a few cells: what they meet there shortens the search for all else.
  if (inside_) {
    if (world_.walks()) {
      world_.kernels.wander(world_.field.view(), world_.snow, rays.walks(lit), marks.key.data(),
                            marks.share.data(), 0, count);
    } else {
      world_.kernels.collide(world_.field.view(), world_.snow, rays.view(), marks.key.data(),
                             marks.share.data(), 0, count);
    }
    find_objects(rays, objects_);
  } else {
    find(rays, first, objects_);
  }
  for (std::size_t i = 0; i < count; ++i) {
    Arrival& arrival = arrivals[i];
    arrival = {};
    const Vec3f o = rays.origin(i), d = rays.direction(i);
    float& t = rays.t(i);
    if (rays.hit(i) != kernels::kNoHit) {
      arrival.what = inside_ ? Meets::snow : Meets::snow_surface;
      if (inside_) {
        arrival.depth = static_cast<int>(rays.hit(i) & kernels::kClass);
        arrival.thick = (rays.hit(i) & kernels::kInThickSnow) != 0;
        arrival.unlit = (rays.hit(i) & kernels::kUnlit) != 0;
      }
    }
    if (inside_ && world_.walks()) {
      arrival.scattered = rays.scattered(i);
      if (arrival.scattered > 0) arrival.lit = world_.snow.lit[rays.last_depth(i)];
    }
    arrival.object = objects_[i];
    if (arrival.object.object >= 0) arrival.what = Meets::object;
    if (world_.lights.hit(o, d, t, arrival.light)) arrival.what = Meets::light;
    if (!world_.media.empty()) {
      const auto flight = world_.media.fly(o, d, t, marks.key[i] ^ kOtherMedia);
      if (flight.medium >= 0) {
        t = flight.t;
        arrival.what = Meets::medium;
        arrival.medium = flight.medium;
      }
      arrival.weight = flight.weight;
    }
    if (arrival.what == Meets::nothing) arrival.light = world_.lights.escape(o, d);
  }
}

void Flights::pass(RayStream& rays, const RayMarks& marks, std::vector<Vec3f>& through) {
  const std::size_t count = rays.size();
  through.assign(count, Vec3f::Zero());
  if (inside_) {
    world_.kernels.collide(world_.field.view(), world_.snow, rays.view(), marks.key.data(),
                           marks.share.data(), 0, count);
  } else {
    find_shadow(rays);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (rays.hit(i) != kernels::kNoHit) continue;
    const Vec3f o = rays.origin(i), d = rays.direction(i);
    float reach = rays.t(i);
    LightHit lamp;
    if (world_.lights.hit(o, d, reach, lamp) || world_.objects.occluded(o, d, reach)) continue;
    through[i] = world_.media.empty() ? Vec3f::Ones() : world_.media.transmittance(o, d, reach);
  }
}

}  // namespace firn
