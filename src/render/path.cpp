// SPDX-License-Identifier: MIT
#include "src/render/path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "src/core/rng.h"
#include "src/render/phase.h"

namespace firn {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kBlock = 4;  // pixels: neighbours in a stream are neighbours on the film
constexpr float kRouletteBelow = 0.5f;
constexpr float kShort = 1 - 1e-4f;  // of the way between two points, so as not to meet the farther's surface
// What snow looks like to a denoiser.
constexpr float kSnowAlbedo = 0.9f;

// Pairs of sample dimensions: five for the start of a subpath, then five for each of its vertices.
// A stream of numbers each for eye subpaths, light subpaths and what connects them.
constexpr std::uint32_t kEyes = 0, kLights = 1u << 30, kLinks = 1u << 31;
constexpr std::uint32_t kFilmPoint = 0, kLensPoint = 1, kLightChoice = 2, kLightPlace = 3,
                        kLightDirection = 4;
constexpr std::uint32_t kChoiceOfLight = 0, kPointOfLight = 1, kScattering = 2, kLobeAndRoulette = 3,
                        kSight = 4;
constexpr std::uint32_t pair_of(int vertices, std::uint32_t which) {
  return 5 * static_cast<std::uint32_t>(vertices) + which;
}

}  // namespace

Ways ways_of(const ImageSettings& image) {
  const int eye = image.max_bounces + 2;  // with the camera and what is seen directly
  const int light = std::min(image.light_bounces + 1, kMostLightVertices);
  switch (image.integrator) {
    case Integrator::path:
      return {1, eye, true, false};
    case Integrator::light:
      return {light, eye, false, true};
    case Integrator::bidirectional:
      break;
  }
  return {light, eye, true, true};
}

TilePaths::TilePaths(const View& view) : view_(view), ways_(ways_of(view.setup.image)) {
  for (const SnowLook& look : view.setup.snow) {
    const SnowLook& first = view.setup.snow.front();
    alike_ =
        alike_ && look.anisotropy == first.anisotropy && look.ice_per_collision == first.ice_per_collision;
  }
}

std::uint64_t TilePaths::trace(const Tile& tile, std::uint32_t first, std::uint32_t last,
                               const PixelSet& wanted, Film& film) {
  rays_traced_ = 0;
  start_paths(tile, first, last, wanted);
  if (ways_.light_vertices > 1) walk_lights(film);
  walk_eyes();
  for (const Path& path : paths_) film.add(path.x, path.y, path.seen);
  return rays_traced_;
}

void TilePaths::start_paths(const Tile& tile, std::uint32_t first, std::uint32_t last,
                            const PixelSet& wanted) {
  paths_.clear();
  const auto frame = static_cast<std::uint64_t>(view_.snapshot.frame);
  for (int y = tile.y0; y < tile.y1; y += kBlock) {
    for (int x = tile.x0; x < tile.x1; x += kBlock) {
      for (std::uint32_t sample = first; sample < last; ++sample) {
        for (int py = y; py < std::min(y + kBlock, tile.y1); ++py) {
          for (int px = x; px < std::min(x + kBlock, tile.x1); ++px) {
            if (!wanted.has(px, py)) continue;
            const auto pixel = static_cast<std::uint64_t>(py) << 32 | static_cast<std::uint32_t>(px);
            const Sampler sampler(view_.setup.seed, frame, pixel);
            Path path;
            path.random = PathRandom(sampler, sample, view_.setup.image.sampler);
            path.x = px, path.y = py;
            paths_.push_back(path);
          }
        }
      }
    }
  }
}

// ---- A vertex, seen from outside

Vec3f TilePaths::Vertex::scattered(const Vec3f& to) const {
  return on_surface ? evaluate(surface, back, to) : Vec3f::Constant(phase_density(g, -back.dot(to)));
}

float TilePaths::Vertex::density(const Vec3f& from, const Vec3f& to) const {
  return on_surface ? firn::density(surface, from, to) : phase_density(g, -from.dot(to));
}

float TilePaths::Vertex::cosine(const Vec3f& direction) const {
  return on_surface ? std::fabs(surface.normal.dot(direction)) : 1.f;
}

Vec3f TilePaths::Vertex::start(const Vec3f& direction) const {
  if (!on_surface) return p;
  return p + (surface.normal.dot(direction) > 0 ? off : -off) * surface.normal;
}

// ---- A step of either kind of subpath

void TilePaths::go_on(const Subpath& subpath, const Vec3f& from, const Vec3f& direction,
                      std::uint32_t stream) {
  next_subpaths_.push_back(subpath);
  next_rays_.push(from, direction, kInfinity);
  next_keys_.push_back(
      paths_[subpath.path].random.key(stream + static_cast<std::uint32_t>(subpath.vertices)));
}

// All that went on finds where it arrives; false if nothing did.
bool TilePaths::fly() {
  std::swap(subpaths_, next_subpaths_);
  std::swap(rays_, next_rays_);
  std::swap(keys_, next_keys_);
  next_subpaths_.clear();
  next_rays_.clear();
  next_keys_.clear();
  if (rays_.size() == 0) return false;
  Flights(view_.world).fly(rays_, keys_, arrivals_);
  rays_traced_ += rays_.size();
  return true;
}

// Snow of other grain scatters otherwise: that of the nearest particle counts.
const SnowLook& TilePaths::look_at(const Vec3f& p) const {
  static const SnowLook plain;
  const auto& looks = view_.setup.snow;
  if (looks.empty()) return plain;
  if (alike_) return looks.front();
  const std::uint32_t near = view_.field.particle_near(p);
  const std::size_t object =
      near == kernels::kNoHit ? 0 : view_.snapshot.object[view_.grid.snapshot_index(near)];
  return looks[std::min(object, looks.size() - 1)];
}

TilePaths::Vertex TilePaths::arrive(Subpath& subpath, std::size_t ray) const {
  const Arrival& arrival = arrivals_[ray];
  const float t = rays_.t(ray);
  Vertex vertex;
  vertex.p = rays_.at_hit(ray);
  vertex.back = -rays_.direction(ray);
  if (arrival.what == Meets::object) {
    vertex.on_surface = true;
    vertex.surface = view_.world.objects.point(arrival.object);
    vertex.specular = is_specular(vertex.surface);
    vertex.off = 4e-6f * std::max(vertex.p.cwiseAbs().maxCoeff(), t);
  } else if (arrival.what == Meets::medium) {
    vertex.g = view_.world.media[arrival.medium].g;
  } else {
    const SnowLook& look = look_at(vertex.p);
    const bool deep = arrival.what == Meets::deep_snow;
    vertex.g = deep ? 0.f : static_cast<float>(look.anisotropy);
    subpath.ice += static_cast<float>(look.ice_per_collision / (deep ? 1 - look.anisotropy : 1));
  }
  subpath.beta = subpath.beta.cwiseProduct(arrival.weight);
  vertex.beta = subpath.beta;
  vertex.ice = subpath.ice;
  const float spread = subpath.distant ? 1.f : 1 / (t * t);
  subpath.trail.arrive(subpath.density * vertex.cosine(vertex.back) * spread, subpath.cosine * spread,
                       vertex.specular ? 0.f : subpath.meets);
  vertex.trail = subpath.trail;
  vertex.place = ++subpath.vertices;
  return vertex;
}

// Chooses how the subpath goes on from a vertex; false if it ends there.
bool TilePaths::leave(Subpath& subpath, const Vertex& vertex, Carries carries, std::uint32_t stream,
                      Vec3f& direction) const {
  const PathRandom& random = paths_[subpath.path].random;
  const Sample2 at = random.pair(stream + pair_of(subpath.vertices, kScattering));
  const Sample2 other = random.pair(stream + pair_of(subpath.vertices, kLobeAndRoulette));
  float reverse = 0;
  if (vertex.on_surface) {
    Scattered scattered;
    if (!scatter(vertex.surface, vertex.back, other.u, at, carries, scattered)) return false;
    direction = scattered.direction;
    subpath.beta = subpath.beta.cwiseProduct(scattered.weight);
    subpath.density = scattered.pdf;
    reverse = scattered.pdf_reverse;
  } else {
    direction = phase_direction(vertex.g, -vertex.back, at);
    subpath.density = reverse = phase_density(vertex.g, -vertex.back.dot(direction));
  }
  subpath.trail.leave(reverse);
  subpath.cosine = vertex.cosine(direction);
  subpath.meets = vertex.specular ? 0.f : 1.f;
  subpath.distant = false;
  const float left = subpath.beta.cwiseProduct(view_.tint(subpath.ice)).maxCoeff() / subpath.brightness;
  if (left >= kRouletteBelow) return true;
  if (!(other.v < left)) return false;
  subpath.beta /= left;
  return true;
}

// A ray that carries light from one end of a connection to the other.
void TilePaths::link(const Vec3f& from, const Vec3f& direction, float distance, const Brings& brings) {
  if (!(brings.light.maxCoeff() > 0)) return;
  link_rays_.push(from, direction, distance * kShort);
  Path& path = paths_[brings.path];
  link_keys_.push_back(path.random.key(kLinks + path.links++));
  brings_.push_back(brings);
}

// ---- Light subpaths

// `light`: what the subpath leaves, as a ray would come upon it.
bool TilePaths::start_light(Subpath& subpath, Vec3f& origin, Vec3f& direction, LightHit& light) const {
  const PathRandom& random = paths_[subpath.path].random;
  Emission start;
  if (!view_.world.lights.emit(random.pair(kLights + kLightChoice).u, random.pair(kLights + kLightPlace),
                               random.pair(kLights + kLightDirection), start))
    return false;
  origin = start.origin;
  direction = start.direction;
  light.light = start.light;
  light.cosine = start.cosine;
  subpath.beta = start.radiance * (start.cosine / start.pdf_emit);
  subpath.brightness = subpath.beta.maxCoeff();
  // The two densities of the first edge are known together: that of the light's point counts as 1.
  subpath.density = start.pdf_emit;
  subpath.cosine = start.cosine;
  subpath.distant = start.distant;
  subpath.trail.arrive(1, 0, 1);
  return subpath.brightness > 0;
}

void TilePaths::walk_lights(Film& film) {
  light_vertices_.clear();
  std::vector<std::uint32_t> path_of;
  lights_left_.resize(paths_.size());
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    Subpath subpath;
    subpath.path = static_cast<std::uint32_t>(k);
    Vec3f origin, direction;
    if (start_light(subpath, origin, direction, lights_left_[k])) go_on(subpath, origin, direction, kLights);
  }
  while (fly()) {
    clear_links();
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
      Subpath& subpath = subpaths_[ray];
      const Meets what = arrivals_[ray].what;
      if (what == Meets::nothing || what == Meets::light) continue;
      if (subpath.vertices == 1) subpath.meets = first_meets(subpath, ray);
      const Vertex vertex = arrive(subpath, ray);
      if (!vertex.specular) {
        if (ways_.to_camera) show(subpath, vertex);
        if (ways_.to_light) {
          light_vertices_.push_back(vertex);
          path_of.push_back(subpath.path);
        }
      }
      Vec3f direction;
      if (subpath.vertices < ways_.light_vertices &&
          leave(subpath, vertex, Carries::importance, kLights, direction))
        go_on(subpath, vertex.start(direction), direction, kLights);
    }
    pass();
    for (std::size_t k = 0; k < brings_.size(); ++k) {
      const Brings& brings = brings_[k];
      film.splat(brings.x, brings.y,
                 brings.light.cwiseProduct(through_[k]).cwiseProduct(view_.tint(brings.ice)));
    }
  }
  sort_light_vertices(path_of);
}

// The first edge of a light subpath counts with the density by which an eye vertex chooses the light's point.
float TilePaths::first_meets(const Subpath& subpath, std::size_t ray) const {
  if (!ways_.to_light) return 0;
  const float t = subpath.distant ? kInfinity : rays_.t(ray);
  const float spread = subpath.distant ? 1.f : subpath.cosine / (t * t);
  return spread *
         view_.world.lights.pdf(rays_.at_hit(ray), -rays_.direction(ray), t, lights_left_[subpath.path]);
}

// Those of one path stand together, in the order of its steps.
void TilePaths::sort_light_vertices(const std::vector<std::uint32_t>& path_of) {
  std::vector<std::uint32_t> order(path_of.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return path_of[a] < path_of[b]; });
  std::vector<Vertex> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t k : order) {
    Path& path = paths_[path_of[k]];
    if (path.first_light == path.end_light) path.first_light = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(light_vertices_[k]);
    path.end_light = static_cast<std::uint32_t>(sorted.size());
  }
  light_vertices_ = std::move(sorted);
}

// The ways that are open to the light's end of a path, beside that with `light` and `eye` vertices: those
// that give vertices to the eye subpath. A light that is come upon may be one vertex more.
int TilePaths::ways_to_eye(int light, int eye) const {
  return light <= ways_.eye_vertices - eye + 1 ? light : ways_.eye_vertices - eye;
}

void TilePaths::show(const Subpath& subpath, const Vertex& vertex) {
  const Path& path = paths_[subpath.path];
  CameraSight eye;
  if (!view_.camera.see(vertex.p, path.random.pair(kLights + pair_of(subpath.vertices, kSight)), eye)) return;
  const float seen = view_.camera.film_density(-eye.direction) * vertex.cosine(eye.direction) /
                     (eye.distance * eye.distance);
  const float pixels =
      static_cast<float>(view_.setup.image.width) * static_cast<float>(view_.setup.image.height);
  const double others = vertex.trail.others(seen / pixels, vertex.density(eye.direction, vertex.back),
                                            ways_.to_light ? ways_to_eye(subpath.vertices, 1) : 0);
  const Vec3f light = vertex.beta.cwiseProduct(vertex.scattered(eye.direction)) *
                      (seen * static_cast<float>(1 / (1 + others)));
  link(vertex.start(eye.direction), eye.direction, eye.distance,
       {subpath.path, light, vertex.ice, eye.x, eye.y});
}

// ---- Eye subpaths

void TilePaths::walk_eyes() {
  const float pixels =
      static_cast<float>(view_.setup.image.width) * static_cast<float>(view_.setup.image.height);
  for (std::size_t k = 0; k < paths_.size(); ++k) {
    const Path& path = paths_[k];
    const CameraRay ray = view_.camera.ray(path.x, path.y, path.random.pair(kEyes + kFilmPoint),
                                           path.random.pair(kEyes + kLensPoint));
    Subpath subpath;
    subpath.path = static_cast<std::uint32_t>(k);
    subpath.density = view_.camera.film_density(ray.direction);
    subpath.meets = ways_.to_camera ? pixels : 0;  // as many light subpaths can be seen at each pixel
    go_on(subpath, ray.origin, ray.direction, kEyes);
  }
  for (bool first = true; fly(); first = false) {
    clear_links();
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) visit(ray);
    pass();
    for (std::size_t k = 0; k < brings_.size(); ++k) add(brings_[k], through_[k]);
    if (first) note_snow();
  }
}

void TilePaths::visit(std::size_t ray) {
  Subpath& subpath = subpaths_[ray];
  Arrival& arrival = arrivals_[ray];
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
  const Subpath& subpath = subpaths_[ray];
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
                 ways_.to_light ? subpath.meets * chosen : 0.f);
    others = trail.others(1, light.pdf_emit, ways_.light_vertices);
  }
  const Vec3f bring = subpath.beta.cwiseProduct(arrival.weight).cwiseProduct(light.radiance);
  add({subpath.path, bring * static_cast<float>(1 / (1 + others)), subpath.ice, 0, 0}, Vec3f::Ones());
}

void TilePaths::sample_light(const Subpath& subpath, const Vertex& vertex) {
  const PathRandom& random = paths_[subpath.path].random;
  LightSample light;
  if (!view_.world.lights.sample(vertex.p, random.pair(kEyes + pair_of(subpath.vertices, kChoiceOfLight)).u,
                                 random.pair(kEyes + pair_of(subpath.vertices, kPointOfLight)), light))
    return;
  const float cosine = vertex.cosine(light.direction);
  const double found = vertex.density(vertex.back, light.direction) / light.pdf;
  const double others =
      found * found + vertex.trail.others(light.pdf_emit * cosine / (light.pdf * light.cosine),
                                          vertex.density(light.direction, vertex.back),
                                          ways_.light_vertices - 1);
  const Vec3f bring =
      vertex.beta.cwiseProduct(vertex.scattered(light.direction)).cwiseProduct(light.radiance) *
      (cosine / light.pdf * static_cast<float>(1 / (1 + others)));
  link(vertex.start(light.direction), light.direction, light.distance,
       {subpath.path, bring, vertex.ice, 0, 0});
}

void TilePaths::connect(const Subpath& subpath, const Vertex& eye) {
  const Path& path = paths_[subpath.path];
  for (std::uint32_t k = path.first_light; k < path.end_light; ++k) {
    const Vertex& light = light_vertices_[k];
    const Vec3f between = light.p - eye.p;
    const float square = between.squaredNorm(), distance = std::sqrt(square);
    if (!(square > 0)) continue;
    const Vec3f to_light = between / distance, to_eye = -to_light;
    const float at_eye = eye.cosine(to_light), at_light = light.cosine(to_eye);
    const double others =
        eye.trail.others(light.density(light.back, to_eye) * at_eye / square, eye.density(to_light, eye.back),
                         ways_.light_vertices - light.place) +
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

// ---- Pixels

void TilePaths::clear_links() {
  link_rays_.clear();
  link_keys_.clear();
  brings_.clear();
}

void TilePaths::pass() {
  Flights(view_.world).pass(link_rays_, link_keys_, through_);
  rays_traced_ += link_rays_.size();
}

void TilePaths::add(const Brings& brings, const Vec3f& through) {
  const Vec3f light = brings.light.cwiseProduct(through);
  if (!(light.maxCoeff() > 0)) return;
  const Vec3f tinted = light.cwiseProduct(view_.tint(brings.ice));
  Path& path = paths_[brings.path];
  path.seen.beauty += tinted;
  if (path.inside) path.seen.subsurface += tinted;
}

void TilePaths::note_first(std::size_t ray, const Vertex& vertex) {
  Path& path = paths_[subpaths_[ray].path];
  path.inside = !vertex.on_surface;
  path.seen.depth = rays_.t(ray);
  path.seen.albedo = vertex.on_surface ? vertex.surface.albedo : Vec3f::Constant(kSnowAlbedo);
  path.seen.normal = vertex.on_surface ? vertex.surface.normal : vertex.back;
  if (path.seen.normal.dot(vertex.back) < 0) path.seen.normal = -path.seen.normal;
}

// The first rays know where they scattered in the snow; what the eye takes for its surface lies before.
void TilePaths::note_snow() {
  if (view_.grid.size() == 0) return;
  const bool smooth = view_.setup.image.snow == SnowShape::smooth;
  if (smooth) {
    view_.world.kernels.surface_closest(view_.field.view(), view_.field.surface(), rays_.view(), 0,
                                        rays_.size());
  } else {
    view_.world.kernels.closest_coherent(view_.grid.view(), rays_.view(), 0, rays_.size());
  }
  rays_traced_ += rays_.size();
  for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
    const std::uint32_t hit = rays_.hit(ray);
    if (hit == kernels::kNoHit) continue;
    const Vec3f p = rays_.at_hit(ray), back = -rays_.direction(ray);
    FilmSample& seen = paths_[subpaths_[ray].path].seen;
    seen.depth = rays_.t(ray);
    seen.albedo = Vec3f::Constant(kSnowAlbedo);
    seen.normal = hit == kernels::kSurfaceHit ? view_.field.normal(p, back)
                                              : Vec3f((p - view_.grid.center(hit)) / view_.grid.radius(hit));
  }
}

}  // namespace firn
