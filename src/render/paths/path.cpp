// SPDX-License-Identifier: MIT
#include "src/render/paths/path.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "src/core/infinity.h"
#include "src/render/paths/path_draws.h"
#include "src/render/sampling/directions.h"
#include "src/render/sampling/phase.h"
#include "src/render/snow/grain.h"

namespace firn {
namespace {

constexpr int kPixelBlock = 4;          // pixels: neighbours in a stream are neighbours on the film
constexpr float kRouletteBelow = 0.1f;  // of what the subpath began with
// Deep snow is at least five mean free paths from the light.
constexpr float kLitDeep = 0.1f;
constexpr float kLift = 1, kAside = 1.5f;  // spacings

}  // namespace

Ways ways_of(const ImageSettings& image) {
  const int eye = image.max_bounces + 2;  // with the camera and what is seen directly
  const int light = std::min(image.light_bounces + 1, kMostLightVertices);
  switch (image.integrator) {
    case Integrator::path:
    case Integrator::preview:
    case Integrator::automatic:
      return {1, eye, true, false};
    case Integrator::light:
      return {light, eye, false, true};
    case Integrator::bidirectional:
      break;
  }
  return {light, eye, true, true};
}

Similarity similarity_of(const ImageSettings& image, const std::vector<SnowLook>& snow) {
  const bool one_mean = std::all_of(snow.begin(), snow.end(), [&](const SnowLook& look) {
    return look.anisotropy == snow.front().anisotropy;
  });
  if (image.reference || !one_mean) return Similarity::never;
  const bool both_ends =
      image.integrator == Integrator::bidirectional || image.integrator == Integrator::light;
  return both_ends ? Similarity::by_depth : Similarity::by_collisions;
}

TilePaths::TilePaths(const View& view)
    : view_(view), ways_(ways_of(view.setup.image)), reduced_share_(1 - view.grains.of(0, false).g) {}

Work TilePaths::trace(const Tile& tile, std::uint32_t first, std::uint32_t last, const PixelSet& wanted,
                      Film& film) {
  work_ = {};
  start_paths(tile, first, last, wanted);
  if (ways_.light_vertices > 1) walk_lights(film);
  walk_eyes();
  for (const Path& path : paths_) film.add(path.x, path.y, path.seen);
  return work_;
}

void TilePaths::start_paths(const Tile& tile, std::uint32_t first, std::uint32_t last,
                            const PixelSet& wanted) {
  paths_.clear();
  const auto frame = static_cast<std::uint64_t>(view_.snapshot.frame);
  for (int y = tile.y0; y < tile.y1; y += kPixelBlock) {
    for (int x = tile.x0; x < tile.x1; x += kPixelBlock) {
      for (std::uint32_t sample = first; sample < last; ++sample) {
        for (int py = y; py < std::min(y + kPixelBlock, tile.y1); ++py) {
          for (int px = x; px < std::min(x + kPixelBlock, tile.x1); ++px) {
            if (!wanted.has(px, py)) continue;
            const auto pixel = static_cast<std::uint64_t>(py) << 32 | static_cast<std::uint32_t>(px);
            const Sampler sampler(view_.setup.seed, frame, pixel);
            Path path;
            path.random = PathRandom(sampler, sample, view_.setup.image.sampler);
            path.x = px, path.y = py, path.sample = sample;
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

void TilePaths::begin_subpaths() {
  subpaths_.assign(paths_.size(), {});
  for (std::size_t k = 0; k < paths_.size(); ++k) subpaths_[k].path = static_cast<std::uint32_t>(k);
}

void TilePaths::go_on(const Subpath& subpath, const Vec3f& from, const Vec3f& direction,
                      std::uint32_t stream) {
  next_going_.push_back(subpath.path);
  next_rays_.push(from, direction, kInfinity);
  next_marks_.push(paths_[subpath.path].random.key(stream + static_cast<std::uint32_t>(subpath.vertices)),
                   is_reduced(subpath) ? reduced_share_ : 1.f);
}

// All that went on finds where it arrives; false if nothing did.
bool TilePaths::fly(bool first) {
  std::swap(going_, next_going_);
  std::swap(rays_, next_rays_);
  std::swap(marks_, next_marks_);
  next_going_.clear();
  next_rays_.clear();
  next_marks_.clear();
  if (rays_.size() == 0) return false;
  Flights(view_.world).fly(rays_, marks_, first, arrivals_, lit_collisions_);
  work_.rays += rays_.size();
  for (const Arrival& arrival : arrivals_) work_.turns += static_cast<std::uint64_t>(arrival.scattered);
  return true;
}

// Whether the snow is thinner and scatters evenly from here on.
bool TilePaths::is_reduced(const Subpath& subpath) const {
  return view_.world.similarity == Similarity::by_collisions && subpath.reduced;
}

// Where objects differ, the nearest particle tells whose snow it is.
const SnowGrain& TilePaths::grain_at(const Vec3f& p, bool reduced) const {
  if (view_.grains.alike()) return view_.grains.of(0, reduced);
  const std::uint32_t near = view_.field.particle_near(p);
  return view_.grains.of(near == kernels::kNoHit ? 0 : view_.snapshot.object[view_.grid.snapshot_index(near)],
                         reduced);
}

// Snow that only has a surface is matt there. Particles stand for thousands of grains, which noise on the
// normal shows; light leaves it a little above and aside of where it came: that keeps clear of the bumps of
// neighbouring particles and stands in for its way through the snow.
void TilePaths::become_surface(Vertex& vertex, std::size_t ray, const Subpath& subpath) const {
  const auto spacing = static_cast<float>(view_.grid.spacing());
  const bool ball = rays_.hit(ray) != kernels::kSurfaceHit;
  const std::uint32_t sorted = ball ? rays_.hit(ray) : view_.field.particle_at_surface(vertex.p);
  const std::uint32_t particle = view_.grid.snapshot_index(sorted);
  const Vec3f from_center = vertex.p - view_.grid.center(sorted);
  const Vec3f smooth =
      ball ? Vec3f(from_center / view_.grid.radius(sorted)) : view_.field.normal(vertex.p, vertex.back);
  vertex.on_surface = true;
  vertex.surface.kind = SurfaceKind::diffuse;
  vertex.surface.normal = grained(smooth, from_center / spacing, view_.snapshot.id[particle], vertex.back);
  vertex.surface.albedo = view_.grains.of(view_.snapshot.object[particle], false).layer;
  const Sample2 at = paths_[subpath.path].random.pair(kLinks + pair_of(subpath.vertices, kEmergence));
  const Disc aside = on_circle(kAside * spacing * std::sqrt(at.u), at.v);
  vertex.p += around(smooth, aside.x, aside.y, kLift * spacing);
}

// What reduced snow does to light that scatters in it.
void TilePaths::scatter_evenly(int times, Vec3f& beta, float& ice) const {
  const SnowGrain& grain = view_.grains.of(0, true);
  ice += static_cast<float>(times) * grain.ice;
  for (int c = 0; c < 3; ++c) {
    if (grain.albedo[c] < 1) beta[c] *= portable_pow(grain.albedo[c], static_cast<float>(times));
  }
}

// The flight scattered in the snow on its way.
void TilePaths::walk_on(Subpath& subpath, const Arrival& arrival) const {
  if (arrival.scattered == 0) return;
  scatter_evenly(arrival.scattered, subpath.beta, subpath.ice);
  subpath.density = phase_density(0, 0);
  subpath.cosine = subpath.meets = 1;
  subpath.lit = arrival.lit;
  subpath.distant = false;
  subpath.vertices += arrival.scattered;
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
  } else if (arrival.what == Meets::snow_surface) {
    become_surface(vertex, ray, subpath);
  } else {
    const bool deep = arrival.depth > 0 && view_.world.similarity == Similarity::by_depth;
    const SnowGrain& grain = grain_at(vertex.p, is_reduced(subpath) || deep);
    vertex.g = grain.g;
    if (deep) {
      vertex.lit = kLitDeep;
      const PathRandom& random = paths_[subpath.path].random;
      vertex.connects = random.pair(kEyes + pair_of(subpath.vertices + 1, kChoiceOfLight)).v < kLitDeep;
    } else if (is_reduced(subpath)) {
      vertex.lit = view_.world.snow.lit[arrival.depth];
      vertex.connects = !arrival.unlit;
    }
    subpath.reduced = subpath.reduced || arrival.thick;
    subpath.ice += grain.ice;
    subpath.beta = subpath.beta.cwiseProduct(grain.albedo);
  }
  subpath.beta = subpath.beta.cwiseProduct(arrival.weight);
  vertex.beta = subpath.beta;
  vertex.ice = subpath.ice;
  const float spread = subpath.distant ? 1.f : 1 / (t * t);
  subpath.trail.arrive(subpath.density * vertex.cosine(vertex.back) * spread, subpath.cosine * spread,
                       vertex.specular ? 0.f : subpath.meets);
  vertex.place = ++subpath.vertices;
  return vertex;
}

// Chooses how the subpath goes on from a vertex; false if it ends there.
bool TilePaths::leave(Subpath& subpath, const Vertex& vertex, Carries carries, std::uint32_t stream,
                      Vec3f& direction) const {
  const PathRandom& random = paths_[subpath.path].random;
  const Sample2 at = random.pair(stream + pair_of(subpath.vertices, kScattering));
  const auto other = [&] { return random.pair(stream + pair_of(subpath.vertices, kLobeAndRoulette)); };
  float reverse = 0;
  if (vertex.on_surface) {
    Scattered scattered;
    if (!scatter(vertex.surface, vertex.back, other().u, at, carries, scattered)) return false;
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
  subpath.lit = vertex.lit;
  subpath.meets = vertex.specular ? 0.f : 1.f;
  subpath.distant = false;
  subpath.spread = subpath.spread || !vertex.specular;
  const float left = subpath.beta.cwiseProduct(view_.tint(subpath.ice)).maxCoeff() / subpath.brightness;
  if (left >= kRouletteBelow) return true;
  if (!(other().v * kRouletteBelow < left)) return false;
  subpath.beta *= kRouletteBelow / left;
  return true;
}

// A ray that carries light from one end of a connection to the other.
void TilePaths::link(const Vec3f& from, const Vec3f& direction, float distance, const Brings& brings) {
  if (!(brings.light.maxCoeff() > 0)) return;
  link_rays_.push(from, direction, distance * kShort);
  Path& path = paths_[brings.path];
  link_marks_.push(path.random.key(kLinks + path.links++),
                   is_reduced(subpaths_[brings.path]) ? reduced_share_ : 1.f);
  brings_.push_back(brings);
}

// ---- Pixels

void TilePaths::clear_links() {
  link_rays_.clear();
  link_marks_.clear();
  brings_.clear();
}

void TilePaths::pass() {
  Flights(view_.world).pass(link_rays_, link_marks_, through_);
  work_.rays += link_rays_.size();
}

void TilePaths::add(const Brings& brings, const Vec3f& through) {
  const Vec3f light = brings.light.cwiseProduct(through);
  if (!(light.maxCoeff() > 0)) return;
  const Vec3f tinted = light.cwiseProduct(view_.tint(brings.ice));
  Path& path = paths_[brings.path];
  path.seen.beauty += tinted;
  if (brings.glint) path.seen.sparkle += tinted;
  if (path.inside && !brings.glint) path.seen.subsurface += tinted;
}

}  // namespace firn
