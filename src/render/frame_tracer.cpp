// SPDX-License-Identifier: MIT
#include "src/render/frame_tracer.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <utility>

#include "firn/error.h"
#include "kernels/table.h"
#include "src/core/parallel.h"
#include "src/render/film/adaptive.h"
#include "src/render/film/denoise.h"
#include "src/render/paths/path.h"
#include "src/render/pilot.h"
#include "src/render/preview/preview.h"
#include "src/render/snow/ice.h"
#include "src/render/snow/relief.h"

namespace firn {
namespace {

constexpr int kTile = 32;                    // pixels
constexpr int kSmallTile = 4;                // of a pilot's pictures, so that all threads have some
constexpr int kSketched = 16;                // one tile of so many is sketched
constexpr std::uint32_t kSamplesAtOnce = 8;  // a pixel; bounds the memory of a tile

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Sparkle is no noise: it is taken out before and put back as it was.
std::vector<float> denoised(const Film& film) {
  std::vector<float> rgb = denoise(film.noisy());
  const std::vector<float> sparkle = std::move(film.picture({Layer::sparkle}).layers[0].values);
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] += sparkle[i];
  return rgb;
}

}  // namespace

struct FrameTracer::State {
  State(const kernels::KernelTable& table, RenderSetup given)
      : kernels(table.trace),
        shade(table.shade),
        setup(std::move(given)),
        camera(setup.camera, setup.image),
        objects(kernels, setup.objects, setup.surfaces),
        lights(setup.lights, objects),
        media(setup.media),
        grid(table.trace),
        snow(table.trace),
        tint(setup.image.ice),
        grains(setup.snow, setup.image.ice),
        layers(setup.snow, setup.image.ice),
        ambient(lights) {
    if (preview() && !setup.media.empty()) {
      throw Error(ErrorCode::usage, "image",
                  "integrator 'preview' does not see media: take 'path' or 'bidirectional'");
    }
  }

  bool preview() const { return setup.image.integrator == Integrator::preview; }

  void build(const Snapshot& snapshot, RenderStats& stats) {
    const auto start = Clock::now();
    grid.build(snapshot, setup.snow, true);
    const auto sorted = Clock::now();
    snow.build(grid, snapshot, setup.snow, setup.image.snow);
    stats.field_seconds += seconds_since(sorted);
    objects.place(grid.origin(), snapshot.time, snapshot.driven);
    media.place(grid.origin());
    camera.place(grid.origin(), snapshot.time);
    const Bounds bounds = lit_bounds();
    lights.place(grid.origin(), bounds.center() - grid.origin(),
                 static_cast<float>(0.5 * bounds.size().norm()));
    if (setup.image.snow_light == SnowLight::inside && !preview()) {
      scattering = snow.medium(optics());
      if (stats.snow_mass == 0) stats.snow_mass = snow.mass(), stats.medium_mass = snow.medium_mass();
    }
    stats.build_seconds += seconds_since(start);
    stats.grid_bytes = std::max(stats.grid_bytes, grid.bytes() + snow.bytes());
  }

  // Walks may go on alone where there is one kind of snow and nothing else.
  SnowOptics optics() const {
    SnowOptics optics;
    if (!setup.snow.empty()) optics.g = static_cast<float>(setup.snow.front().anisotropy);
    optics.similarity = similarity_of(setup.image, setup.snow);
    // Enough for roulette to be worth it.
    const float albedo = grains.of(0, true).albedo.maxCoeff();
    if (albedo < 0.99f) optics.most_scattered = static_cast<std::uint32_t>(2.3f / (1 - albedo)) + 1;
    if (grains.alike() && media.empty() && grid.view().stray_bundles == 0) {
      optics.shared = [this](const Vec3f& low, const Vec3f& high) {
        return objects.may_reach(low, high) || lights.may_reach(low, high);
      };
    }
    return optics;
  }

  // What light subpaths should reach: all that has an end, world space.
  Bounds lit_bounds() const {
    Bounds bounds;
    const auto include = [&bounds](const Bounds& box) {
      if (box.size().norm() < 1e30) bounds.include(box);
    };
    if (grid.size() > 0) {
      const auto& view = grid.view();
      const Vec3 size = Vec3(view.cells[0], view.cells[1], view.cells[2]) * static_cast<double>(view.cell);
      include({grid.origin(), grid.origin() + size});
    }
    for (int i = 0; i < objects.count(); ++i) include(objects.bounds(i));
    for (const Medium& medium : setup.media) include(world_bounds(medium.shape));
    if (bounds.empty()) {
      const Vec3 reach = Vec3::Constant((setup.camera.target - setup.camera.position).norm());
      bounds = {setup.camera.target - reach, setup.camera.target + reach};
    }
    return bounds;
  }

  // Calls body(view, tile) for all tiles of the film; each task has a TileWork of its own.
  template <class Body>
  void for_each_tile(const Snapshot& snapshot, int side, RenderStats& stats, Body&& body) {
    const auto start = Clock::now();
    const World world = this->world();
    const Sparkle sparkle(grid, snapshot, setup.snow);
    const View view{world, shade, camera, grid, snow, snapshot, setup, tint, grains, sparkle};
    const int width = setup.image.width, height = setup.image.height;
    const int across = (width + side - 1) / side, down = (height + side - 1) / side;
    std::atomic<std::uint64_t> rays{0}, turns{0};
    parallel_for(static_cast<std::size_t>(across) * down, 1, [&](std::size_t index) {
      const int x = static_cast<int>(index % across) * side, y = static_cast<int>(index / across) * side;
      const Tile tile{x, y, std::min(x + side, width), std::min(y + side, height)};
      const Work work = body(view, tile);
      rays.fetch_add(work.rays, std::memory_order_relaxed);
      turns.fetch_add(work.turns, std::memory_order_relaxed);
    });
    stats.rays += rays.load();
    stats.turns += turns.load();
    stats.trace_seconds += seconds_since(start);
  }

  World world() const {
    return {kernels,    objects,     lights,
            media,      grid,        snow,
            scattering, setup.image, similarity_of(setup.image, setup.snow)};
  }

  // Adds a range of samples of the world as it was built last.
  void trace(const Snapshot& snapshot, const SampleRange& range, int side, RenderStats& stats,
             const std::stop_token& stop) {
    PerThread<std::optional<TilePaths>> scratch;  // fresh memory costs more than filling it
    for_each_tile(snapshot, side, stats, [&](const View& view, const Tile& tile) {
      Work work;
      if (!wanted.any(tile)) return work;
      std::optional<TilePaths>& paths = scratch.mine();
      if (!paths) paths.emplace(view);
      for (std::uint32_t first = range.first; first < range.last; first += kSamplesAtOnce) {
        if (stop.stop_requested()) break;
        work += paths->trace(tile, first, std::min(first + kSamplesAtOnce, range.last), wanted, film);
      }
      return work;
    });
  }

  // From now on pictures are taken with these settings, of the world as it was built last.
  void take(const ImageSettings& image, double time) {
    const bool same = similarity_of(image, setup.snow) == similarity_of(setup.image, setup.snow);
    setup.image = image;
    camera = CameraRays(setup.camera, image);
    camera.place(grid.origin(), time);
    if (image.snow_light == SnowLight::inside && !same) scattering = snow.medium(optics());
  }

  Shot shoot(const Snapshot& snapshot, const ImageSettings& image, const std::stop_token& stop) {
    take(image, snapshot.time);
    film.begin(image.width, image.height, camera.filter(), {.splats = ways_of(image).to_camera});
    wanted = PixelSet(image.width, image.height);
    RenderStats stats;
    trace(snapshot, {0, static_cast<std::uint32_t>(image.samples)}, kSmallTile, stats, stop);
    return {film.picture({}), {stats.rays, stats.turns}};
  }

  // Which integrator takes the picture. The world is as it was built last.
  Choice choose(const Snapshot& snapshot, RenderStats& stats, const std::stop_token& stop) {
    const auto start = Clock::now();
    const RenderSetup asked = setup;
    Choice choice = choose_integrator(asked, [&](const ImageSettings& image, std::uint64_t seed) {
      setup.seed = seed;
      return shoot(snapshot, image, stop);
    });
    setup.seed = asked.seed;
    ImageSettings image = asked.image;
    image.integrator = choice.integrator;
    take(image, snapshot.time);
    stats.pilot_seconds = seconds_since(start);
    return choice;
  }

  // A picture of the film's size with the layers asked for, what is in it undefined.
  void open_picture(Picture& picture) const {
    picture.width = setup.image.width;
    picture.height = setup.image.height;
    const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
    picture.rgb.resize(3 * pixels);
    picture.layers.clear();
    for (const Layer layer : setup.layers) {
      if (layer != Layer::beauty)
        picture.layers.push_back({layer, std::vector<float>(channels_of(layer) * pixels)});
    }
  }

  // The world is as it was built last.
  Sights sights(const Snapshot& snapshot) {
    Sights all = no_sights(setup);
    std::mutex adding;
    RenderStats stats;
    for_each_tile(snapshot, kTile, stats, [&](const View& view, const Tile& tile) {
      const Sights seen = sights_of(view, tile);
      const std::lock_guard lock(adding);
      all += seen;
      return Work{};
    });
    return all;
  }

  // Takes the memory of a whole picture for a few of its tiles.
  void sketch(const Snapshot& snapshot, Picture& picture) {
    RenderStats stats;
    const std::stop_token stop;  // nobody asks
    if (preview()) {
      ambient.look_around(world(), grid.middle());
      trace_preview(snapshot, picture, stats, stop);
      return;
    }
    const ImageSettings asked = setup.image;
    ImageSettings image = asked;  // `auto` mostly comes to `path`
    if (image.integrator == Integrator::automatic) image.integrator = Integrator::path;
    take(image, snapshot.time);
    film.begin(image.width, image.height, camera.filter(), content());
    wanted = PixelSet(image.width, image.height);
    wanted.keep_one_tile_of(kSketched, kTile);
    const auto samples = static_cast<std::uint32_t>(image.samples);
    trace(snapshot, {0, std::min(samples, kSamplesAtOnce)}, kTile, stats, stop);
    picture = film.picture(setup.layers);
    if (content().denoise) picture.rgb = denoised(film);
    setup.image = asked;
  }

  // False if stopped. The world is as it was built last.
  bool trace_preview(const Snapshot& snapshot, Picture& picture, RenderStats& stats,
                     const std::stop_token& stop) {
    stats.mean_samples = 1;
    open_picture(picture);
    std::mutex adding;
    // One a thread: fresh memory costs more than what is done with it.
    PerThread<std::optional<PreviewTile>> painters;
    for_each_tile(snapshot, kTile, stats, [&](const View& view, const Tile& tile) {
      if (stop.stop_requested()) return Work{};
      PreviewTimes times;
      std::optional<PreviewTile>& painter = painters.mine();
      if (!painter) painter.emplace(view, ambient, layers);
      const std::uint64_t rays = painter->trace(tile, picture, times);
      const std::lock_guard lock(adding);
      stats.preview.add(times);
      return Work{rays, 0};
    });
    return !stop.stop_requested();
  }

  // Moments at which a frame is seen: one without a shutter, else the middles of even parts of the time that
  // it is open, which is centred on the frame's.
  std::uint32_t moments() const {
    const int slices = setup.camera.shutter > 0 ? setup.image.motion_slices : 1;
    return static_cast<std::uint32_t>(std::min(slices, setup.image.samples));
  }

  // False if stopped.
  bool preview(const Snapshot& snapshot, Picture& picture, RenderStats& stats, const std::stop_token& stop) {
    build(snapshot, stats);
    ambient.look_around(world(), grid.middle());
    return trace_preview(snapshot, picture, stats, stop);
  }

  // The snow as it is at a moment: each particle goes on with its velocity.
  const Snapshot& at_moment(const Snapshot& snapshot, std::uint32_t moment) {
    const double open = setup.camera.shutter * setup.frame_seconds;
    const double late = open * ((moment + 0.5) / moments() - 0.5);
    moved = snapshot;
    moved.time += late;
    for (int a = 0; a < 3; ++a) {
      parallel_chunks(moved.size(), 65536, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          moved.position[a][i] += static_cast<float>(late) * moved.velocity[a][i];
      });
    }
    return moved;
  }

  // False if stopped.
  bool expose(const Snapshot& snapshot, RenderStats& stats, const std::stop_token& stop) {
    const bool chooses = setup.image.integrator == Integrator::automatic;
    if (chooses || moments() == 1) build(snapshot, stats);
    const ImageSettings asked = setup.image;
    stats.choice = chooses ? choose(snapshot, stats, stop) : Choice{asked.integrator, ""};
    const bool finished = gather(snapshot, stats, stop);
    setup.image = asked;
    return finished;
  }

  // Every moment has its share of each round, so that all of them weigh alike in every pixel, whenever it is
  // done. A single one is built.
  bool gather(const Snapshot& snapshot, RenderStats& stats, const std::stop_token& stop) {
    const auto samples = static_cast<std::uint32_t>(setup.image.samples);
    const std::uint32_t parts = moments();
    film.begin(setup.image.width, setup.image.height, camera.filter(), content());
    wanted = PixelSet(setup.image.width, setup.image.height);
    for (SampleRange round; round.last < samples && !stop.stop_requested();) {
      round = next_round(round.last, samples, setup.image.noise > 0);
      for (std::uint32_t part = 0; part < parts; ++part) {
        const Snapshot& now = parts == 1 ? snapshot : at_moment(snapshot, part);
        if (parts > 1) build(now, stats);
        trace(now, share(round, part, parts), kTile, stats, stop);
      }
      if (round.last < samples) drop_finished(film, setup.image.noise, wanted);
    }
    return !stop.stop_requested();
  }

  FilmContent content() const {
    const auto asked = [this](Layer layer) {
      return std::find(setup.layers.begin(), setup.layers.end(), layer) != setup.layers.end();
    };
    FilmContent content;
    content.guides = asked(Layer::albedo) || asked(Layer::normal) || asked(Layer::depth);
    content.denoise = setup.denoise;
    content.sparkle = asked(Layer::sparkle);
    content.subsurface = asked(Layer::subsurface);
    content.splats = ways_of(setup.image).to_camera;
    return content;
  }

  const kernels::TraceKernels& kernels;
  const kernels::ShadeKernels& shade;
  RenderSetup setup;
  CameraRays camera;
  ObjectSet objects;
  LightSet lights;
  MediumSet media;
  RenderGrid grid;
  SnowField snow;
  kernels::MediumField scattering;
  IceTint tint;
  SnowGrains grains;
  SnowLayers layers;
  AmbientLight ambient;
  Film film;
  PixelSet wanted;
  Snapshot moved;
};

FrameTracer::FrameTracer(const kernels::KernelTable& kernels, RenderSetup setup)
    : state_(std::make_unique<State>(kernels, std::move(setup))) {}
FrameTracer::~FrameTracer() = default;
FrameTracer::FrameTracer(FrameTracer&&) noexcept = default;

const RenderSetup& FrameTracer::setup() const { return state_->setup; }

bool FrameTracer::render(const Snapshot& given, Picture& picture, RenderStats& stats,
                         const std::stop_token& stop) {
  stats = {};
  const int detail = state_->setup.image.detail;
  const Snapshot finer = detail > 1 ? with_relief(given, detail) : Snapshot{};
  const Snapshot& snapshot = detail > 1 ? finer : given;
  if (state_->preview()) return state_->preview(snapshot, picture, stats, stop);
  const bool finished = state_->expose(snapshot, stats, stop);
  const Film& film = state_->film;
  stats.mean_samples =
      static_cast<double>(film.samples()) / (static_cast<double>(film.width()) * film.height());
  picture = film.picture(state_->setup.layers);
  if (finished && state_->content().denoise) picture.rgb = denoised(film);
  return finished;
}

Sights FrameTracer::look(const Snapshot& given, Picture& picture) {
  const int detail = state_->setup.image.detail;
  const Snapshot finer = detail > 1 ? with_relief(given, detail) : Snapshot{};
  const Snapshot& snapshot = detail > 1 ? finer : given;
  RenderStats stats;
  state_->build(state_->moments() > 1 ? state_->at_moment(snapshot, 0) : snapshot, stats);
  Sights sights = state_->sights(snapshot);
  state_->sketch(snapshot, picture);
  return sights;
}

bool FrameTracer::look_again(const Snapshot& snapshot, const Camera& from, Picture& picture,
                             RenderStats& stats, const std::stop_token& stop) {
  stats = {};
  state_->setup.camera = from;
  state_->camera = CameraRays(from, state_->setup.image);
  state_->camera.place(state_->grid.origin(), snapshot.time);
  return state_->trace_preview(snapshot, picture, stats, stop);
}

}  // namespace firn
