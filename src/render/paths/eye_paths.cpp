// SPDX-License-Identifier: MIT
// Eye subpaths: they leave the camera, come upon lights, and are connected to lights and light subpaths.
#include <algorithm>
#include <cmath>

#include "src/core/infinity.h"
#include "src/render/paths/path.h"
#include "src/render/paths/path_draws.h"

namespace firn {
namespace {

// What snow looks like to a denoiser.
constexpr float kSnowAlbedo = 0.9f;
constexpr std::size_t kAskAtOnce = 2048;  // collisions: their columns stay in the second cache level

}  // namespace

void TilePaths::walk_eyes() {
  const float pixels =
      static_cast<float>(view_.setup.image.width) * static_cast<float>(view_.setup.image.height);
  begin_subpaths();
  for (Subpath& subpath : subpaths_) {
    const Path& path = paths_[subpath.path];
    const CameraRay ray = view_.camera.ray(path.x, path.y, path.random.pair(kEyes + kFilmPoint),
                                           path.random.pair(kEyes + kLensPoint));
    subpath.density = view_.camera.film_density(ray.direction);
    subpath.meets = ways_.to_camera ? pixels : 0;  // as many light subpaths can be seen at each pixel
    go_on(subpath, ray.origin, ray.direction, kEyes);
  }
  for (bool first = true; fly(first); first = false) {
    clear_links();
    light_walks();
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) visit(ray);
    if (first) see_snow();
    pass();
    for (std::size_t k = 0; k < brings_.size(); ++k) add(brings_[k], through_[k]);
  }
}

// Where the flights scattered on their way.
void TilePaths::light_walks() {
  const std::span<const kernels::LitCollision> all = lit_collisions_.all();
  for (std::size_t k = 0; k < all.size(); k += kAskAtOnce)
    light_walks(all.subspan(k, std::min(kAskAtOnce, all.size() - k)));
}

void TilePaths::light_walks(std::span<const kernels::LitCollision> lit) {
  light_asks_.clear();
  for (std::size_t k = 0; k < lit.size(); ++k) {
    const Subpath& subpath = subpath_of(lit[k].ray);
    const int place = subpath.vertices + walked_times(lit[k].scattered);
    if (place > ways_.eye_vertices) continue;
    light_asks_.push(paths_[subpath.path].random, kEyes + pair_of(place, kChoiceOfLight),
                     {lit[k].p[0], lit[k].p[1], lit[k].p[2]}, static_cast<std::uint32_t>(k));
  }
  light_asks_.send(view_.world, view_.shade, kWalkLinks, reduced_share_);
  work_.rays += light_asks_.size();
  for (std::size_t i = 0; i < light_asks_.size(); ++i) {
    LightSample light;
    if (light_asks_.through(i).isZero() || !light_asks_.light(view_.world.lights, i, light)) continue;
    const kernels::LitCollision& its = lit[light_asks_.whose(i)];
    const Subpath& subpath = subpath_of(its.ray);
    add(bring(subpath, walk_vertex(subpath, its), light), light_asks_.through(i));
  }
}

TilePaths::Vertex TilePaths::walk_vertex(const Subpath& subpath, const kernels::LitCollision& lit) const {
  const int times = walked_times(lit.scattered);
  Vertex vertex;
  vertex.place = subpath.vertices + times;
  vertex.p = {lit.p[0], lit.p[1], lit.p[2]};
  vertex.beta = subpath.beta;
  vertex.ice = subpath.ice;
  vertex.lit = view_.world.snow.lit[walked_class(lit.scattered)];
  scatter_evenly(times, vertex.beta, vertex.ice);
  return vertex;
}

void TilePaths::visit(std::size_t ray) {
  Subpath& subpath = subpath_of(ray);
  Arrival& arrival = arrivals_[ray];
  walk_on(subpath, arrival);
  if (subpath.vertices > ways_.eye_vertices) return;
  const bool glows = arrival.what == Meets::object &&
                     view_.world.lights.object_hit(arrival.object.object, rays_.direction(ray),
                                                   arrival.object, arrival.light);
  if (glows || arrival.what == Meets::nothing || arrival.what == Meets::light) {
    find_light(ray);
    return;
  }
  if (subpath.vertices >= ways_.eye_vertices) return;
  const Vertex vertex = arrive(subpath, ray);
  if (subpath.vertices == 2) note_first(ray, vertex);
  if (!vertex.specular) {
    if (!ways_.to_light) return;
    sample_light(subpath, vertex);
    connect(subpath, vertex);
  }
  Vec3f direction;
  if (leave(subpath, vertex, Carries::radiance, kEyes, direction))
    go_on(subpath, vertex.start(direction), direction, kEyes);
}

// The ray came upon a light.
void TilePaths::find_light(std::size_t ray) {
  const Subpath& subpath = subpath_of(ray);
  const Arrival& arrival = arrivals_[ray];
  const LightHit& light = arrival.light;
  double others = 0;
  if (subpath.vertices > 1) {
    const bool distant = arrival.what == Meets::nothing;
    const float t = distant ? kInfinity : rays_.t(ray), spread = distant ? 1.f : 1 / (t * t);
    const Vec3f d = rays_.direction(ray);
    const float chosen = view_.world.lights.pdf(rays_.origin(ray), d, t, light) * light.cosine * spread;
    Trail trail = subpath.trail;
    trail.arrive(subpath.density * light.cosine * spread, subpath.cosine * spread,
                 ways_.to_light ? subpath.meets * counted(subpath.lit) * chosen : 0.f);
    others = trail.others(1, light.pdf_emit, ways_.light_vertices);
  }
  // A sun that a matt surface sees in a mirror is only met by chance, once in a thousand paths and then
  // glaring: noise. It is left to light subpaths, if there are any.
  const bool by_chance = subpath.spread && subpath.meets == 0 && arrival.what == Meets::nothing &&
                         ways_.light_vertices == 1 && !view_.setup.image.reference;
  const Vec3f radiance = by_chance ? view_.world.lights.sky(rays_.direction(ray)) : light.radiance;
  const Vec3f bring = subpath.beta.cwiseProduct(arrival.weight).cwiseProduct(radiance);
  add({subpath.path, bring * static_cast<float>(1 / (1 + others)), subpath.ice, 0, 0}, Vec3f::Ones());
}

void TilePaths::sample_light(const Subpath& subpath, const Vertex& vertex) {
  const PathRandom& random = paths_[subpath.path].random;
  LightSample light;
  if (!vertex.connects) return;
  const Sample2 choice = random.pair(kEyes + pair_of(vertex.place, kChoiceOfLight));
  if (!view_.world.lights.sample(vertex.p, choice.u,
                                 random.pair(kEyes + pair_of(vertex.place, kPointOfLight)), light))
    return;
  link(vertex.start(light.direction), light.direction, light.distance, bring(subpath, vertex, light));
}

// What the light brings to a vertex that asked for it.
TilePaths::Brings TilePaths::bring(const Subpath& subpath, const Vertex& vertex,
                                   const LightSample& light) const {
  const float cosine = vertex.cosine(light.direction);
  const double found = vertex.density(vertex.back, light.direction) / (light.pdf * counted(vertex.lit));
  const double others =
      found * found + subpath.trail.others(light.pdf_emit * cosine / (light.pdf * light.cosine),
                                           vertex.density(light.direction, vertex.back),
                                           ways_.light_vertices - 1);
  const Vec3f brought =
      vertex.beta.cwiseProduct(vertex.scattered(light.direction)).cwiseProduct(light.radiance) *
      (cosine / (light.pdf * vertex.lit) * static_cast<float>(1 / (1 + others)));
  return {subpath.path, brought, vertex.ice, 0, 0};
}

void TilePaths::connect(const Subpath& subpath, const Vertex& eye) {
  const Path& path = paths_[subpath.path];
  for (std::uint32_t k = path.first_light; k < path.end_light; ++k) {
    const LightVertex& light = light_vertices_[k];
    const Vec3f between = light.p - eye.p;
    const float square = between.squaredNorm(), distance = std::sqrt(square);
    if (!(square > 0)) continue;
    const Vec3f to_light = between / distance, to_eye = -to_light;
    const float at_eye = eye.cosine(to_light), at_light = light.cosine(to_eye);
    const double others =
        subpath.trail.others(light.density(light.back, to_eye) * at_eye / square,
                             eye.density(to_light, eye.back), ways_.light_vertices - light.place) +
        light.trail.others(eye.density(eye.back, to_light) * at_light / square,
                           light.density(to_eye, light.back), ways_to_eye(light.place, subpath.vertices));
    const Vec3f bring = eye.beta.cwiseProduct(eye.scattered(to_light))
                            .cwiseProduct(light.beta)
                            .cwiseProduct(light.scattered(to_eye)) *
                        (at_eye * at_light / square * static_cast<float>(1 / (1 + others)));
    const Vec3f from = eye.start(to_light), way = light.start(to_eye) - from;
    const float length = way.norm();
    link(from, way / length, length, {subpath.path, bring, eye.ice + light.ice, 0, 0});
  }
}

void TilePaths::note_first(std::size_t ray, const Vertex& vertex) {
  Path& path = paths_[going_[ray]];
  path.inside = !vertex.on_surface;
  path.seen.depth = rays_.t(ray);
  path.seen.albedo = vertex.on_surface ? vertex.surface.albedo : Vec3f::Constant(kSnowAlbedo);
  path.seen.normal = vertex.on_surface ? vertex.surface.normal : vertex.back;
  if (path.seen.normal.dot(vertex.back) < 0) path.seen.normal = -path.seen.normal;
  path.seen.lit_normal = path.seen.normal;
}

// The first rays know where they scattered in the snow; what the eye takes for its surface lies before.
void TilePaths::see_snow() {
  if (view_.grid.size() == 0) return;
  const bool inside = view_.setup.image.snow_light == SnowLight::inside;
  if (inside) {
    Flights(view_.world).find_surface(rays_, true);
    work_.rays += rays_.size();
  }
  for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
    const std::uint32_t hit = rays_.hit(ray);
    if (hit == kernels::kNoHit || (!inside && arrivals_[ray].what != Meets::snow_surface)) continue;
    const bool ball = hit != kernels::kSurfaceHit;
    const Vec3f p = rays_.at_hit(ray), back = -rays_.direction(ray);
    const Vec3f normal =
        ball ? Vec3f((p - view_.grid.center(hit)) / view_.grid.radius(hit)) : view_.field.normal(p, back);
    FilmSample& seen = paths_[going_[ray]].seen;
    seen.depth = rays_.t(ray);
    seen.albedo = Vec3f::Constant(kSnowAlbedo);
    seen.normal = normal;
    if (inside) seen.lit_normal = normal;
    if (view_.sparkle.any()) glint(ray, ball ? hit : view_.field.particle_at_surface(p), normal);
  }
}

// The facets of ice in the snow's surface mirror a light to the camera.
void TilePaths::glint(std::size_t ray, std::uint32_t sorted, const Vec3f& normal) {
  const Vec3f p = rays_.at_hit(ray), back = -rays_.direction(ray);
  const std::uint32_t index = going_[ray];
  const PathRandom& random = paths_[index].random;
  LightSample light;
  if (!view_.world.lights.sample(p, random.pair(kEyes + pair_of(0, kChoiceOfGlint)).u,
                                 random.pair(kEyes + pair_of(0, kPointOfGlint)), light))
    return;
  const float cosine = normal.dot(light.direction);
  if (!(cosine > 0) || !(normal.dot(back) > 0)) return;
  const float footprint = 0.5f * rays_.t(ray) / std::sqrt(view_.camera.film_density(-back));
  const float brdf = view_.sparkle.brdf(sorted, p, normal, back, light.direction, 0, footprint);
  Brings brings{index, light.radiance * (brdf * cosine / light.pdf), 0, 0, 0};
  brings.glint = true;
  link(p, light.direction, light.distance, brings);
}

}  // namespace firn
