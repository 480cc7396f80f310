// SPDX-License-Identifier: MIT
// Continues a run where it stopped, whatever stopped it: finished frames are kept, the simulation goes on
// from the checkpoint, or from the start if none fits, with the same bits either way.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <thread>

#include "src/app/commands.h"
#include "src/app/interrupt.h"
#include "src/app/new_run.h"
#include "src/app/verify.h"
#include "src/core/isa.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"
#include "src/io/program.h"

namespace firn {
namespace {

// The kernels of x86-64-v3 and v4 give the same bits; those of `base` do not, so such a run stays with them.
std::string isa_of(const Options& options, const Manifest& manifest) {
  if (options.isa == "auto") return manifest.isa == "base" ? "base" : "auto";
  if ((options.isa == "base") != (manifest.isa == "base")) {
    throw Error(ExitCode::usage, "--isa",
                "this run was begun with " + manifest.isa +
                    ", and the kernels of base and of AVX differ in the last bits");
  }
  return options.isa;
}

// A checkpoint can be used if all the frames that it has passed and that are not finished are kept in it.
bool covers(const Checkpoint& checkpoint, int first) {
  for (int frame = first; frame <= checkpoint.frame; ++frame) {
    const auto is_frame = [frame](const PendingFrame& pending) { return pending.snow.frame == frame; };
    if (!std::any_of(checkpoint.pending.begin(), checkpoint.pending.end(), is_frame)) return false;
  }
  return true;
}

// The latest that can be used. One that cannot be read is told of and passed over.
std::optional<Checkpoint> find_checkpoint(Production& run, int first) {
  const std::string& scene = run.manifest().scene;
  for (const int frame : run.folder().saved_checkpoints()) {
    try {
      Checkpoint checkpoint =
          read_checkpoint(run.folder().checkpoint(frame), hash_bytes(scene.data(), scene.size()));
      if (covers(checkpoint, first)) return checkpoint;
    } catch (const Error& error) {
      run.progress().say(std::string(error.what()) + "; it is not used");
    }
  }
  return std::nullopt;
}

void restore(Production& run, SimulatedSnow& snow, int first) {
  if (auto checkpoint = find_checkpoint(run, first)) {
    snow.restore(std::move(*checkpoint), first);
  } else if (first > 0) {
    run.progress().say("There is no checkpoint from before frame " + std::to_string(first) +
                       ": simulating again from the start.");
  }
}

// Whether nothing is left to do.
bool is_complete(Production& run, int first) {
  const Manifest& m = run.manifest();
  if (m.status != "complete" || first <= m.last) return false;
  if (m.movie.empty() || m.movie_hash.empty()) return true;
  const std::string fault = fault_of(run.folder().path() / m.movie, m.movie_hash);
  if (!fault.empty()) run.progress().say(fault + ": making it again.");
  return fault.empty();
}

ExitCode end(Production& run, int first) {
  const ExitCode code = run.produce(first, run.manifest().last, stop_flag());
  std::cout << run.folder().path().string() << "\n";
  return code;
}

}  // namespace

ExitCode resume_command(const Options& options) {
  RunFolder folder = RunFolder::open(options.target);
  folder.lock();
  Manifest manifest = read_manifest(folder.manifest(), folder.journal());
  require_scene(folder, manifest);
  const auto [first, why] = first_unfinished(folder, manifest);
  const std::string isa = isa_of(options, manifest);
  const auto& kernels = choose_kernels(isa);
  SceneConfig scene = read_scene_text(manifest.scene, manifest.scene_file, {});
  require_inputs(manifest, scene);
  manifest.isa = kernels.isa;
  manifest.slots = options.overlap ? kSlots : 1;
  manifest.threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());

  Production run(std::move(folder), std::move(scene), std::move(manifest), options.quiet);
  const Manifest& m = run.manifest();
  run.again = shell_line({"firn", "resume", options.target});
  if (!why.empty())
    run.progress().say(why + ": frame " + std::to_string(first) + " and those after it are made again.");
  if (is_complete(run, first)) {
    run.repair();
    run.progress().say("This run is complete.");
    std::cout << run.folder().path().string() << "\n";
    return ExitCode::ok;
  }
  if (m.pictures) run.renderer = make_renderer(run.scene(), kernels);
  if (first > m.last) {
    run.progress().say(run.scene().name + ": all frames are there");
    return end(run, first);
  }
  if (m.snow_from.empty()) {
    run.simulated = make_snow(run.scene(), kernels, m.force);
    restore(run, *run.simulated, first);
  } else {
    run.recorded = std::make_unique<RecordedSnow>(m.snow_from);
    run.recorded->require(m.frames);
  }
  run.expected_seconds = expected_frame_seconds(run.scene(), run.simulated.get(), m.pictures, m.threads);
  run.progress().say(run.scene().name + ": resuming at frame " + std::to_string(first) + " of " +
                     std::to_string(m.first) + "-" + std::to_string(m.last));
  return end(run, first);
}

}  // namespace firn
