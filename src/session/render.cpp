// SPDX-License-Identifier: MIT
// Pictures of the particles that a run kept, without a movie.
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "src/core/isa.h"
#include "src/core/threads.h"
#include "src/io/journal.h"
#include "src/io/program.h"
#include "src/session/prepare.h"
#include "src/session/verify.h"

namespace firn {
namespace {

// Frames of the run that have particles, checked before anything is made.
std::pair<int, int> frames_to_show(const std::string& target, const SessionOptions& options,
                                   const RunFolder& source, const Manifest& run) {
  if (!run.particles || run.frames.empty()) {
    throw Error(ErrorCode::usage, target,
                "this run kept no particles; make one with 'firn simulate' or --set output.particles=true");
  }
  // Of a complete run all, though the first or the last may have been damaged since.
  const bool complete = run.status == "complete";
  const auto frames = options.frames.value_or(std::pair(complete ? run.first : run.frames.front().frame,
                                                        complete ? run.last : run.frames.back().frame));
  if (frames.first < 0 || frames.first > frames.second) {
    throw Error(ErrorCode::usage, "frames", "expected a first and a last frame, counted from 0");
  }
  std::set<int> finished;
  for (const FrameRecord& record : run.frames) finished.insert(record.frame);
  for (int frame = frames.first; frame <= frames.second; ++frame) {
    if (finished.count(frame) && std::filesystem::exists(source.particle_file(frame))) continue;
    std::string what = "this run has no particles of frame " + std::to_string(frame);
    if (frame >= run.first && frame <= run.last)
      what += "; '" + shell_line({"firn", "resume", as_operand(target)}) + "' makes what is missing";
    throw Error(ErrorCode::usage, target, what);
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

std::unique_ptr<Session::State> begin_rendering(const std::string& target, const ReadOptions& reading,
                                                const SessionOptions& options, Observer& observer) {
  require_options(options);
  RunFolder source = RunFolder::open(target);
  const Manifest simulated = options.out ? read_manifest(source.manifest(), source.journal()) : share(source);
  const auto& kernels = choose_kernels(options.out ? options.isa : isa_of(options, simulated));
  require_scene(source, simulated);
  const auto frames = frames_to_show(target, options, source, simulated);
  if (reading.quick)
    throw Error(ErrorCode::usage, "quick",
                "a run has its size already; image.width and so on change that of its pictures");
  std::error_code ignored;
  if (options.out && std::filesystem::equivalent(*options.out, target, ignored)) {
    throw Error(ErrorCode::usage, *options.out,
                "this is the run to be rendered: without --out its pictures come into it");
  }
  if (!options.out && !reading.overrides.empty()) {
    throw Error(ErrorCode::usage, target, "rendering a run with other values needs an --out of its own");
  }
  require_inputs_exist(simulated);
  SceneConfig scene = read_scene_text(simulated.scene, simulated.scene_file, reading);
  require_inputs(simulated, scene);
  auto renderer = make_tracer(scene, kernels);
  auto snow = std::make_unique<RecordedSnow>(target);

  Manifest manifest = options.out ? new_manifest(options, scene, kernels.isa) : simulated;
  if (options.out) {
    manifest.wants_movie = false;
    manifest.snow_from = std::filesystem::absolute(target).string();
    manifest.snow_origin = simulated.origin();
    require_utf8(manifest.snow_from, target);
    std::tie(manifest.first, manifest.last) = frames;
    source = RunFolder::take(scene.name, options.out, options.overwrite);
  }
  manifest.command = options.command;
  // Each slot is a claim on a frame: of shared ones a process takes the one that it traces and the next.
  manifest.slots = !options.overlap ? 1 : options.out ? kSlots : 2;
  manifest.threads = Threads::count_of(options.threads);
  auto made =
      std::make_unique<Session::State>(std::move(source), std::move(scene), std::move(manifest), observer);
  Session::State& run = *made;
  run.expected_seconds = expected_frame_seconds(run.scene(), nullptr, true, run.manifest().threads);
  run.renderer = std::move(renderer);
  run.recorded = std::move(snow);
  run.frames = frame_range(frames.first, frames.second);
  if (options.out) return made;
  tell_of_other_build(run);
  run.shared = std::make_unique<SharedFrames>(run.folder(), run.manifest(), run.frames, options.overwrite);
  if (run.shared->left().empty()) run.tell("All these pictures are there; --overwrite renders them again.");
  return made;
}

}  // namespace

Session Session::render(const std::string& run, const SessionOptions& options, const ReadOptions& changes,
                        Observer& observer) {
  return Session(
      Threads(options.threads).run([&] { return begin_rendering(run, changes, options, observer); }));
}

}  // namespace firn
