// SPDX-License-Identifier: MIT
// Pictures without a movie. Of a scene: the frames asked for (the initial state if none), simulated on the
// way. Of a run: the particles that it kept, into its own folder or, with --out, as a run of its own.
#include <filesystem>
#include <iostream>
#include <tuple>
#include <utility>

#include "src/app/commands.h"
#include "src/app/interrupt.h"
#include "src/app/new_run.h"
#include "src/app/verify.h"
#include "src/core/isa.h"
#include "src/io/program.h"

namespace firn {
namespace {

// Frames of the run that have particles, checked before anything is made.
std::pair<int, int> frames_to_show(const Options& options, const RunFolder& source, const Manifest& run) {
  if (!run.particles || run.frames.empty()) {
    throw Error(ExitCode::usage, options.target,
                "this run kept no particles; make one with 'firn simulate' or --set output.particles=true");
  }
  const auto frames = options.frames.value_or(std::pair(run.frames.front().frame, run.frames.back().frame));
  for (int frame = frames.first; frame <= frames.second; ++frame) {
    if (!std::filesystem::exists(source.particle_file(frame))) {
      throw Error(ExitCode::usage, options.target,
                  "this run has no particles of frame " + std::to_string(frame));
    }
  }
  return frames;
}

// Into the run's own folder: pictures that are there are kept, so that an interrupted rendering goes on when
// repeated.
int first_missing_picture(Production& run, std::pair<int, int> frames) {
  int frame = frames.first;
  while (frame <= frames.second && has_pictures(run.folder(), run.manifest(), frame)) ++frame;
  return frame;
}

ExitCode render_run(const Options& options) {
  const auto& kernels = choose_kernels(options.isa);
  RunFolder source = RunFolder::open(options.target);
  if (!options.out) source.lock();
  const Manifest simulated = read_manifest(source.manifest(), source.journal());
  require_scene(source, simulated);
  const auto frames = frames_to_show(options, source, simulated);
  if (options.quick)
    throw Error(ExitCode::usage, "--quick",
                "a run has its size already; --set image.width and so on change its pictures");
  std::error_code ignored;
  if (options.out && std::filesystem::equivalent(*options.out, options.target, ignored)) {
    throw Error(ExitCode::usage, *options.out,
                "this is the run to be rendered: without --out its pictures come into it");
  }
  if (!options.out && !options.overrides.empty()) {
    throw Error(ExitCode::usage, options.target,
                "rendering a run with other values needs an --out of its own");
  }
  SceneConfig scene = read_scene_text(simulated.scene, simulated.scene_file, options.reading());
  require_inputs(simulated, scene);
  auto renderer = make_renderer(scene, kernels);
  auto snow = std::make_unique<RecordedSnow>(options.target);

  Manifest manifest = options.out ? new_manifest(options, scene, kernels.isa) : simulated;
  if (options.out) {
    manifest.wants_movie = false;
    manifest.snow_from = std::filesystem::absolute(options.target).string();
    require_utf8(manifest.snow_from, options.target);
    std::tie(manifest.first, manifest.last) = frames;
    source = RunFolder::take(scene.name, options.out, options.overwrite);
  }
  manifest.command = options.typed;
  manifest.slots = options.overlap ? kSlots : 1;
  if (options.threads > 0) manifest.threads = options.threads;
  Production run(std::move(source), std::move(scene), std::move(manifest), options.quiet);
  run.expected_seconds = expected_frame_seconds(run.scene(), nullptr, true, run.manifest().threads);
  run.renderer = std::move(renderer);
  run.recorded = std::move(snow);
  run.in_place = !options.out;
  run.again = options.out ? shell_line({"firn", "resume", *options.out})
                          : shell_line({"firn", "render", options.target});
  const bool keep = run.in_place && !options.overwrite;
  const int first = keep ? first_missing_picture(run, frames) : frames.first;
  if (first > frames.second)
    run.progress().say("All these pictures are there; --overwrite renders them again.");
  const ExitCode code = run.produce(first, frames.second, stop_flag());
  std::cout << run.folder().path().string() << "\n";
  return code;
}

}  // namespace

ExitCode render_command(const Options& options) {
  if (std::filesystem::is_directory(options.target)) return render_run(options);
  RunKind kind;
  kind.movie = false;
  kind.frames = std::pair(0, 0);
  return run_scene(options, kind);
}

}  // namespace firn
