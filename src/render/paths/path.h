// SPDX-License-Identifier: MIT
// Bidirectional path tracing through surfaces and media, a tile of pixels and some samples at a time. Light
// subpaths leave the lights and eye subpaths the camera; every vertex of an eye subpath is connected to a
// point of a light and to every vertex of its path's light subpath, whose vertices are connected to the
// camera as well. Every way of finding a path is weighted (mis.h). One sample of each kind of ray is drawn
// per vertex. All rays of one kind and step form a stream, so that the kernels always see many, and each path
// adds to its own pixel in a fixed order. The integrators `path` and `light` are the same code with fewer
// ways.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/shade/table.h"
#include "src/render/camera.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/film/film.h"
#include "src/render/film/tile.h"
#include "src/render/paths/flights.h"
#include "src/render/paths/light_asks.h"
#include "src/render/paths/mis.h"
#include "src/render/pilot.h"
#include "src/render/sampling/sampler.h"
#include "src/render/snow/ice.h"
#include "src/render/snow/snow_grain.h"
#include "src/render/snow/sparkle.h"
#include "src/render/solids/scattering.h"

namespace firn {

// All that the paths of a frame read.
struct View {
  const World& world;
  const kernels::ShadeKernels& shade;
  const CameraRays& camera;
  const RenderGrid& grid;
  const SnowField& field;
  const Snapshot& snapshot;
  const RenderSetup& setup;
  const IceTint& tint;
  const SnowGrains& grains;
  const Sparkle& sparkle;
};

// Which ways of finding a path there are, besides coming upon a light.
struct Ways {
  int light_vertices = 1;  // at most, of a light subpath, the one on the light included; 1: no light subpaths
  int eye_vertices = 2;    // at most, of an eye subpath, the camera included
  bool to_light = true;    // eye vertices are connected to lights and light subpaths
  bool to_camera = false;  // light vertices are connected to the camera
};
Ways ways_of(const ImageSettings& image);
// Where light's walk through the snow is shortened by similarity. Of ways that must agree on one path, none
// can count its collisions from the eye: they go by depth. Nowhere if the snows scatter by different means:
// light that passes from one to the other would have to change its extinction on the way.
Similarity similarity_of(const ImageSettings& image, const std::vector<SnowLook>& snow);

class TilePaths {
 public:
  explicit TilePaths(const View& view);

  // Adds samples [first, last) of the tile's pixels that are in `wanted`; returns what it took. Memory grows
  // with the number of samples.
  Work trace(const Tile& tile, std::uint32_t first, std::uint32_t last, const PixelSet& wanted, Film& film);

 private:
  // Where a subpath scatters.
  struct Vertex {
    Vec3f p = Vec3f::Zero();      // m
    Vec3f back = Vec3f::UnitZ();  // unit, towards the vertex before
    Vec3f beta;                   // throughput by density, up to here
    float ice = 0;                // m of ice that the subpath has crossed
    bool on_surface = false, specular = false;
    SurfacePoint surface;
    float off = 0;         // m, that rays leave above the surface
    float g = 0;           // in a medium
    float lit = 1;         // the chance that it is connected to a light
    bool connects = true;  // what was drawn of that
    int place = 1;         // how many vertices its subpath has with it

    Vec3f scattered(const Vec3f& to) const;                   // BSDF or phase function, 1/sr
    float density(const Vec3f& from, const Vec3f& to) const;  // of going there, coming from there; 1/sr
    float cosine(const Vec3f& direction) const;               // 1 in a medium
    Vec3f start(const Vec3f& direction) const;                // of a ray that leaves it
  };
  struct LightVertex : Vertex {
    Trail trail;
  };
  // On its way from one vertex to the next.
  struct Subpath {
    std::uint32_t path = 0;
    Vec3f beta = Vec3f::Ones();
    float ice = 0;
    float density = 1;     // of its direction, per solid angle
    float cosine = 1;      // at the vertex that it left
    float meets = 0;       // how its present edge counts where subpaths meet
    float lit = 1;         // the chance that the vertex it left was connected to a light
    bool distant = false;  // it comes from a light at infinity
    bool spread = false;   // a surface or medium behind it scattered
    int vertices = 1;      // so far
    float brightness = 1;  // of its start: roulette is about what is left of it
    bool reduced = false;  // it collided in thick snow: similarity
    Trail trail;
  };
  struct Path {
    PathRandom random;
    FilmSample seen;
    int x = 0, y = 0;
    std::uint32_t sample = 0;                      // of the pixel
    std::uint32_t first_light = 0, end_light = 0;  // its vertices in light_vertices_
    std::uint32_t links = 0;                       // connecting rays so far
    bool inside = false;                           // what it met first scatters inside
  };
  // What a connecting ray brings if it comes through.
  struct Brings {
    std::uint32_t path;
    Vec3f light;
    float ice;
    float x, y;          // pixels: of light that goes to the camera
    bool glint = false;  // it comes from the snow's facets
  };

  void start_paths(const Tile& tile, std::uint32_t first, std::uint32_t last, const PixelSet& wanted);

  void walk_lights(Film& film);
  bool start_light(Subpath& subpath, Vec3f& origin, Vec3f& direction, LightHit& light) const;
  float first_meets(const Subpath& subpath, std::size_t ray) const;
  void sort_light_vertices(const std::vector<std::uint32_t>& path_of);
  void show(const Subpath& subpath, const Vertex& vertex);
  int ways_to_eye(int light, int eye) const;

  void begin_subpaths();
  void walk_eyes();
  void visit(std::size_t ray);
  void find_light(std::size_t ray);
  void light_walks();
  void light_walks(std::span<const kernels::LitCollision> lit);
  Vertex walk_vertex(const Subpath& subpath, const kernels::LitCollision& lit) const;
  void sample_light(const Subpath& subpath, const Vertex& vertex);
  Brings bring(const Subpath& subpath, const Vertex& vertex, const LightSample& light) const;
  void connect(const Subpath& subpath, const Vertex& eye);

  void go_on(const Subpath& subpath, const Vec3f& from, const Vec3f& direction, std::uint32_t stream);
  bool fly(bool first);
  Subpath& subpath_of(std::size_t ray) { return subpaths_[going_[ray]]; }
  void become_surface(Vertex& vertex, std::size_t ray, const Subpath& subpath) const;
  Vertex arrive(Subpath& subpath, std::size_t ray) const;
  void scatter_evenly(int times, Vec3f& beta, float& ice) const;
  bool leave(Subpath& subpath, const Vertex& vertex, Carries carries, std::uint32_t stream,
             Vec3f& direction) const;
  const SnowGrain& grain_at(const Vec3f& p, bool reduced) const;
  bool is_reduced(const Subpath& subpath) const;
  float counted(float lit) const { return view_.world.walks() ? lit : 1; }
  void walk_on(Subpath& subpath, const Arrival& arrival) const;

  void link(const Vec3f& from, const Vec3f& direction, float distance, const Brings& brings);
  void clear_links();
  void pass();

  void add(const Brings& brings, const Vec3f& through);
  void note_first(std::size_t ray, const Vertex& vertex);
  void see_snow();
  void glint(std::size_t ray, std::uint32_t sorted, const Vec3f& normal);

  const View& view_;
  Ways ways_;
  float reduced_share_;  // of the snow's extinction
  Work work_;
  std::vector<Path> paths_;
  std::vector<Subpath> subpaths_;  // per path
  // Whose subpaths are on their way, a ray each, and whose will be in the next step.
  std::vector<std::uint32_t> going_, next_going_;
  RayStream rays_, next_rays_;
  RayMarks marks_, next_marks_;
  std::vector<Arrival> arrivals_;
  LitCollisions lit_collisions_;
  LightAsks light_asks_;
  // Connecting rays.
  RayStream link_rays_;
  RayMarks link_marks_;
  std::vector<Brings> brings_;
  std::vector<Vec3f> through_;
  std::vector<LightVertex> light_vertices_;
  std::vector<LightHit> lights_left_;  // per path: where its light subpath began
};

}  // namespace firn
