// SPDX-License-Identifier: MIT
// A new run of a scene.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "firn/error.h"
#include "src/core/isa.h"
#include "src/core/text.h"
#include "src/core/threads.h"
#include "src/scene/validate.h"
#include "src/session/prepare.h"

namespace firn {
namespace {

void set_frames(Manifest& manifest, const SceneConfig& scene,
                const std::optional<std::pair<int, int>>& frames) {
  if (!frames) return;
  if (frames->first < 0 || frames->first > frames->second || frames->second >= scene.time.frames) {
    throw Error(
        ErrorCode::usage, "frames",
        "the scene has frames 0-" + std::to_string(scene.time.frames - 1) + " (set time.frames for more)");
  }
  manifest.first = frames->first;
  manifest.last = frames->second;
}

// A run keeps its scene as text, for resume and render.
void require_text(const SceneConfig& scene) {
  for (std::size_t i = 0; i < scene.snow.size(); ++i) {
    if (!scene.snow[i].shape.points) continue;
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", i), "file"),
                "snow '" + scene.snow[i].name +
                    "' is made of arrays, which the folder of a run cannot keep: write them to a file "
                    "(firn::write_points, numpy.savez) and name that as its 'file'");
  }
}

std::string opening_line(const Session::State& run, const Manifest& m, std::size_t particles) {
  char text[256];
  std::snprintf(text, sizeof text, "%s: %s particles, dx %g mm, frames %d-%d", run.scene().name.c_str(),
                grouped(particles).c_str(), 1e3 * grid_spacing(run.scene()), m.first, m.last);
  std::string line = text;
  if (m.pictures)
    line += " of " + std::to_string(run.scene().image.width) + "x" + std::to_string(run.scene().image.height);
  return line + ", " + std::to_string(m.threads) + " threads, " + m.isa + " -> " +
         run.folder().path().string();
}

std::unique_ptr<Session::State> begin_new(SceneConfig scene, const SessionOptions& options,
                                          Observer& observer) {
  require_text(scene);
  require_options(options);
  const auto& kernels = choose_kernels(options.isa);
  Manifest manifest = new_manifest(options, scene, kernels.isa);
  set_frames(manifest, scene, options.frames);
  manifest.pictures = options.pictures;
  manifest.particles = options.particles || scene.output.particles;
  manifest.wants_movie = options.movie && options.pictures && scene.output.movie;
  if (manifest.wants_movie && manifest.last > manifest.first) require_movie(scene);
  auto renderer = options.pictures ? make_tracer(scene, kernels) : nullptr;
  RunFolder folder = RunFolder::take(scene.name, options.out, options.overwrite);
  for (const auto& [file, hash] : manifest.inputs) folder.require_outside(file);
  observer.made_folders(folder.made());
  auto snow = make_snow(scene, kernels, options.force);

  auto run =
      std::make_unique<Session::State>(std::move(folder), std::move(scene), std::move(manifest), observer);
  run->expected_seconds =
      expected_frame_seconds(run->scene(), snow.get(), options.pictures, run->manifest().threads);
  run->tell(opening_line(*run, run->manifest(), snow->simulation().particle_count()));
  run->simulated = std::move(snow);
  run->renderer = std::move(renderer);
  run->frames = frame_range(run->manifest().first, run->manifest().last);
  observer.made_folders({});
  return run;
}

}  // namespace

Session Session::start(const Scene& scene, const SessionOptions& options, Observer& observer) {
  return Session(
      Threads(options.threads).run([&] { return begin_new(config_of(scene), options, observer); }));
}

}  // namespace firn
