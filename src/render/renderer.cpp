// SPDX-License-Identifier: MIT
#include "src/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "kernels/table.h"
#include "src/core/parallel.h"
#include "src/render/path.h"
#include "src/render/relief.h"

namespace firn {
namespace {

constexpr int kTile = 16;  // pixels

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
        lights(setup.lights),
        grid(table.trace),
        snow(table.trace) {}

  void build(const Snapshot& snapshot) {
    const bool smooth = setup.image.snow == SnowShape::smooth;
    grid.build(snapshot, setup.snow, smooth);
    if (smooth) snow.build(grid, snapshot, setup.snow);
    objects.place(grid.origin(), snapshot.time);
    lights.place(grid.origin());
  }

  // False if stopped; adds up the rays.
  bool trace(const Snapshot& snapshot, Film& film, std::uint64_t& rays, const std::atomic<bool>& stop) {
    const View view{kernels, camera, objects, lights, grid, snow, snapshot, setup};
    const int across = (film.width + kTile - 1) / kTile, down = (film.height + kTile - 1) / kTile;
    std::atomic<std::uint64_t> count{0};
    parallel_for(static_cast<std::size_t>(across) * down, 1, [&](std::size_t index) {
      if (stop.load(std::memory_order_relaxed)) return;
      const int x = static_cast<int>(index % across) * kTile, y = static_cast<int>(index / across) * kTile;
      const Tile tile{x, y, std::min(x + kTile, film.width), std::min(y + kTile, film.height)};
      TilePaths paths(view);
      count.fetch_add(paths.trace(tile, film), std::memory_order_relaxed);
    });
    rays = count.load();
    return !stop.load();
  }

  const kernels::TraceKernels& kernels;
  RenderSetup setup;
  CameraRays camera;
  ObjectSet objects;
  LightSet lights;
  RenderGrid grid;
  SnowField snow;
};

Renderer::Renderer(const kernels::KernelTable& kernels, RenderSetup setup)
    : state_(std::make_unique<State>(kernels, std::move(setup))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

bool Renderer::render(const Snapshot& given, Film& film, RenderStats& stats, const std::atomic<bool>& stop) {
  film.resize(state_->setup.image.width, state_->setup.image.height);
  stats = {};
  const auto start = Clock::now();
  const int detail = state_->setup.image.detail;
  Snapshot finer;
  if (detail > 1) finer = with_relief(given, detail);
  const Snapshot& snapshot = detail > 1 ? finer : given;
  state_->build(snapshot);
  stats.build_seconds = seconds_since(start);
  stats.grid_bytes = state_->grid.bytes() + state_->snow.bytes();
  const auto traced = Clock::now();
  const bool finished = state_->trace(snapshot, film, stats.rays, stop);
  stats.trace_seconds = seconds_since(traced);
  return finished;
}

}  // namespace firn
