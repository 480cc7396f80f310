// SPDX-License-Identifier: MIT
// Paths of light through one tile, all at once: camera rays -> hits -> shadow rays and bounce rays -> ... ->
// pixels. Unidirectional path tracing with next-event estimation. The rays of one bounce form one stream, so
// that the kernels always see many rays, and each path adds to its own pixel in a fixed order.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/trace/table.h"
#include "src/render/camera.h"
#include "src/render/film.h"
#include "src/render/lights.h"
#include "src/render/objects.h"
#include "src/render/ray_stream.h"
#include "src/render/render_grid.h"
#include "src/render/snow_field.h"

namespace firn {

// All that a path can meet; lives as long as the frame.
struct View {
  const kernels::TraceKernels& kernels;
  const CameraRays& camera;
  const ObjectSet& objects;
  const LightSet& lights;
  const RenderGrid& grid;
  const SnowField& snow;
  const Snapshot& snapshot;
  const RenderSetup& setup;
};

struct Tile {
  int x0, y0, x1, y1;  // pixels, half open
};

class TilePaths {
 public:
  explicit TilePaths(const View& view) : view_(view) {}

  // Fills the tile's pixels with the mean of their samples; returns the number of rays traced.
  std::uint64_t trace(const Tile& tile, Film& film);

 private:
  struct Path {
    Vec3f beta;   // throughput
    Vec3f light;  // radiance so far
    int pixel_x, pixel_y;
    std::uint32_t sample;
    float pdf;  // with which its ray was scattered, per solid angle; infinite from the camera and mirrors
  };
  // Where a path arrived.
  struct Vertex {
    Vec3f start;   // m, where rays leave from: just off the surface
    Vec3f normal;  // unit, on the side the path came from
    Vec3f albedo;
    SurfaceKind kind;
  };

  void start_paths(const Tile& tile, std::uint32_t first_sample, std::uint32_t last_sample);
  void meet(std::uint32_t depth);
  void shade(std::uint32_t depth);
  void find_light(std::size_t ray, Path& path, const LightHit& hit) const;
  bool arrive(std::size_t ray, std::uint32_t depth, Path& path, Vertex& vertex) const;
  Vertex snow_vertex(std::size_t ray, const Path& path, std::uint32_t depth) const;
  Vertex object_vertex(std::size_t ray) const;
  void sample_light(std::uint32_t path, const Vertex& vertex, std::uint32_t depth);
  void bounce(std::uint32_t path, const Vertex& vertex, std::uint32_t depth);
  void trace_shadows();
  void add_to(const Tile& tile, std::vector<Vec3f>& sums) const;
  Sample2 draw(const Path& path, std::uint32_t pair) const;

  const View& view_;
  std::uint64_t rays_traced_ = 0;
  std::vector<Path> paths_;
  RayStream rays_, next_rays_, shadows_;
  std::vector<std::uint32_t> path_of_, next_path_of_, path_of_shadow_;
  std::vector<ObjectHit> meetings_;
  std::vector<LightHit> lamp_;       // that a ray met; light < 0: none
  std::vector<Vec3f> shadow_light_;  // what an unblocked shadow ray brings
};

}  // namespace firn
