// SPDX-License-Identifier: MIT
// Pictures without a movie. Of a scene: the frames asked for (the initial state if none), simulated on the
// way. Of a run: the particles that it kept, into its own folder or, with --out, as a run of its own.
#include <filesystem>
#include <iostream>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "src/app/commands.h"
#include "src/app/interrupt.h"
#include "src/app/new_run.h"
#include "src/app/shared_frames.h"
#include "src/app/verify.h"
#include "src/core/isa.h"
#include "src/io/journal.h"
#include "src/io/program.h"

namespace firn {
namespace {

// Frames of the run that have particles, checked before anything is made.
std::pair<int, int> frames_to_show(const Options& options, const RunFolder& source, const Manifest& run) {
  if (!run.particles || run.frames.empty()) {
    throw Error(ExitCode::usage, options.target,
                "this run kept no particles; make one with 'firn simulate' or --set output.particles=true");
  }
  // Of a complete run all, though the first or the last may have been damaged since.
  const bool complete = run.status == "complete";
  const auto frames = options.frames.value_or(std::pair(complete ? run.first : run.frames.front().frame,
                                                        complete ? run.last : run.frames.back().frame));
  std::set<int> finished;
  for (const FrameRecord& record : run.frames) finished.insert(record.frame);
  for (int frame = frames.first; frame <= frames.second; ++frame) {
    if (finished.count(frame) && std::filesystem::exists(source.particle_file(frame))) continue;
    std::string what = "this run has no particles of frame " + std::to_string(frame);
    if (frame >= run.first && frame <= run.last)
      what += "; '" + shell_line({"firn", "resume", as_operand(options.target)}) + "' makes what is missing";
    throw Error(ExitCode::usage, options.target, what);
  }
  return frames;
}

// Into the run's own folder, which other processes may do at the same time. The first of them tidies up: a
// run of version 0.1 gets its journal, and what was cut off goes.
Manifest share(RunFolder& source) {
  const bool alone = source.lock_shared();
  Manifest run = read_manifest(source.manifest(), source.journal());
  if (!alone) return run;
  replace_journal(source.journal(), run.key(), run.frames);
  write_manifest(source.manifest(), run);
  source.begin();
  source.share_with_others();
  return run;
}

std::string command_again(const Options& options) {
  if (options.out) return shell_line({"firn", "resume", as_operand(*options.out)});
  std::vector<std::string> words = {"firn", "render", as_operand(options.target)};
  if (options.overwrite) words.push_back("--overwrite");
  return shell_line(words);
}

ExitCode render_run(const Options& options) {
  RunFolder source = RunFolder::open(options.target);
  const Manifest simulated = options.out ? read_manifest(source.manifest(), source.journal()) : share(source);
  const auto& kernels = choose_kernels(options.out ? options.isa : isa_of(options, simulated));
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
  require_inputs_exist(simulated);
  SceneConfig scene = read_scene_text(simulated.scene, simulated.scene_file, options.reading());
  require_inputs(simulated, scene);
  auto renderer = make_renderer(scene, kernels);
  auto snow = std::make_unique<RecordedSnow>(options.target);

  Manifest manifest = options.out ? new_manifest(options, scene, kernels.isa) : simulated;
  if (options.out) {
    manifest.wants_movie = false;
    manifest.snow_from = std::filesystem::absolute(options.target).string();
    manifest.snow_origin = simulated.origin();
    require_utf8(manifest.snow_from, options.target);
    std::tie(manifest.first, manifest.last) = frames;
    source = RunFolder::take(scene.name, options.out, options.overwrite);
  }
  manifest.command = options.typed;
  // Each slot is a claim on a frame: of shared ones a process takes the one that it traces and the next.
  manifest.slots = !options.overlap ? 1 : options.out ? kSlots : 2;
  if (options.threads > 0) manifest.threads = options.threads;
  Production run(std::move(source), std::move(scene), std::move(manifest), options.quiet);
  run.expected_seconds = expected_frame_seconds(run.scene(), nullptr, true, run.manifest().threads);
  run.renderer = std::move(renderer);
  run.recorded = std::move(snow);
  run.again = command_again(options);
  if (!options.out) tell_of_other_build(run);
  const std::vector<int> wanted = frame_range(frames.first, frames.second);
  if (!options.out) {
    run.shared = std::make_unique<SharedFrames>(run.folder(), run.manifest(), wanted, options.overwrite);
    if (run.shared->left().empty())
      run.progress().say("All these pictures are there; --overwrite renders them again.");
  }
  const ExitCode code = run.produce(wanted, stop_flag());
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
