// SPDX-License-Identifier: MIT
#include "src/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "kernels/table.h"
#include "src/core/parallel.h"
#include "src/render/ice.h"
#include "src/render/path.h"

namespace firn {
namespace {

constexpr int kTile = 16;                     // pixels
constexpr std::uint32_t kSamplesAtOnce = 16;  // a pixel; bounds the memory of a tile

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

struct Renderer::State {
  State(const kernels::KernelTable& table, RenderSetup given)
      : kernels(table.trace),
        setup(std::move(given)),
        camera(setup.camera, setup.image),
        objects(setup.objects, setup.surfaces),
        lights(setup.lights, objects),
        media(setup.media),
        grid(table.trace),
        snow(table.trace),
        tint(setup.image.ice) {}

  void build(const Snapshot& snapshot) {
    grid.build(snapshot, setup.snow, true);
    snow.build(grid, snapshot, setup.snow, setup.image.snow);
    const SnowLook look = setup.snow.empty() ? SnowLook{} : setup.snow.front();
    scattering = snow.medium({static_cast<float>(look.anisotropy), setup.image.reference});
    objects.place(grid.origin(), snapshot.time);
    media.place(grid.origin());
    camera.place(grid.origin(), snapshot.time);
    const Bounds bounds = lit_bounds(snapshot.time);
    lights.place(grid.origin(), bounds.center() - grid.origin(),
                 static_cast<float>(0.5 * bounds.size().norm()));
  }

  // What light subpaths should reach: all that has an end, world space.
  Bounds lit_bounds(double time) const {
    Bounds bounds;
    const auto include = [&bounds](const Bounds& box) {
      if (box.size().norm() < 1e30) bounds.include(box);
    };
    if (grid.size() > 0) {
      const auto& view = grid.view();
      const Vec3 size = Vec3(view.cells[0], view.cells[1], view.cells[2]) * static_cast<double>(view.cell);
      include({grid.origin(), grid.origin() + size});
    }
    for (const Object& object : setup.objects)
      include(world_bounds({object.shape.form, object.motion.pose(object.shape.pose, time)}));
    for (const Medium& medium : setup.media) include(world_bounds(medium.shape));
    if (bounds.empty()) {
      const Vec3 reach = Vec3::Constant((setup.camera.target - setup.camera.position).norm());
      bounds = {setup.camera.target - reach, setup.camera.target + reach};
    }
    return bounds;
  }

  // False if stopped; adds up the rays.
  bool trace(const Snapshot& snapshot, const PixelSet& wanted, std::uint64_t& rays,
             const std::atomic<bool>& stop) {
    const World world{kernels, objects, lights, media, snow.view(), scattering};
    const View view{world, camera, grid, snow, snapshot, setup, tint};
    const auto samples = static_cast<std::uint32_t>(setup.image.samples);
    const int width = film.width(), height = film.height();
    const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
    std::atomic<std::uint64_t> count{0};
    parallel_for(static_cast<std::size_t>(across) * down, 1, [&](std::size_t index) {
      if (stop.load(std::memory_order_relaxed)) return;
      const int x = static_cast<int>(index % across) * kTile, y = static_cast<int>(index / across) * kTile;
      const Tile tile{x, y, std::min(x + kTile, width), std::min(y + kTile, height)};
      TilePaths paths(view);
      for (std::uint32_t first = 0; first < samples; first += kSamplesAtOnce) {
        const std::uint32_t last = std::min(first + kSamplesAtOnce, samples);
        count.fetch_add(paths.trace(tile, first, last, wanted, film), std::memory_order_relaxed);
      }
    });
    rays = count.load();
    return !stop.load();
  }

  const kernels::TraceKernels& kernels;
  RenderSetup setup;
  CameraRays camera;
  ObjectSet objects;
  LightSet lights;
  MediumSet media;
  RenderGrid grid;
  SnowField snow;
  kernels::MediumField scattering;
  IceTint tint;
  Film film;
};

Renderer::Renderer(const kernels::KernelTable& kernels, RenderSetup setup)
    : state_(std::make_unique<State>(kernels, std::move(setup))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

bool Renderer::render(const Snapshot& snapshot, Picture& picture, RenderStats& stats,
                      const std::atomic<bool>& stop) {
  const ImageSettings& image = state_->setup.image;
  state_->film.begin(image.width, image.height, state_->camera.filter(), {});
  stats = {};
  const auto start = Clock::now();
  state_->build(snapshot);
  stats.build_seconds = seconds_since(start);
  stats.grid_bytes = state_->grid.bytes() + state_->snow.bytes();
  const auto traced = Clock::now();
  const bool finished = state_->trace(snapshot, {image.width, image.height}, stats.rays, stop);
  stats.trace_seconds = seconds_since(traced);
  picture = state_->film.picture({});
  return finished;
}

}  // namespace firn
