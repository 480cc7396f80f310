// SPDX-License-Identifier: MIT
// Continues a run where it stopped, whatever stopped it: finished frames are kept, the simulation goes on
// from the checkpoint, or from the start if none fits, with the same bits either way.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <thread>

#include "src/app/commands.h"
#include "src/app/interrupt.h"
#include "src/app/new_run.h"
#include "src/core/isa.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"

namespace firn {
namespace {

// The kernels of x86-64-v3 and v4 give the same bits; those of `base` do not, so such a run stays with them.
std::string isa_of(const Options& options, const Manifest& manifest) {
  if (options.isa != "auto" || manifest.isa != "base") return options.isa;
  return manifest.isa;
}

// A checkpoint can be used if all the frames that it has passed and that are not finished are kept in it.
bool covers(const Checkpoint& checkpoint, const Manifest& manifest, int first) {
  for (int frame = first; frame <= checkpoint.frame; ++frame) {
    const auto is_frame = [frame](const auto& x) { return x.frame == frame; };
    if (!std::any_of(checkpoint.pending.begin(), checkpoint.pending.end(), is_frame)) return false;
    if (!std::any_of(manifest.ahead.begin(), manifest.ahead.end(), is_frame)) return false;
  }
  return true;
}

void restore(Production& run, SimulatedSnow& snow, int first) {
  const auto path = run.folder().checkpoint();
  if (!std::filesystem::exists(path)) {
    if (first > run.manifest().first)
      run.progress().say("There is no checkpoint: simulating again from the start.");
    return;
  }
  const auto& scene = run.manifest().scene;
  Checkpoint checkpoint = read_checkpoint(path, hash_bytes(scene.data(), scene.size()));
  if (!covers(checkpoint, run.manifest(), first)) {
    if (first > 0)
      run.progress().say("The checkpoint is newer than the frames: simulating again from the start.");
    return;
  }
  snow.restore(std::move(checkpoint), run.manifest().ahead);
}

}  // namespace

ExitCode resume_command(const Options& options) {
  RunFolder folder = RunFolder::open(options.target);
  Manifest manifest = read_manifest(folder.manifest());
  const int first = first_unfinished(folder, manifest);
  const std::string isa = isa_of(options, manifest);
  const auto& kernels = choose_kernels(isa);
  SceneConfig scene = read_scene_text(manifest.scene, manifest.scene_file, {});
  manifest.isa = kernels.isa;
  manifest.slots = options.overlap ? 3 : 1;
  manifest.threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());

  Production run(std::move(folder), std::move(scene), std::move(manifest), options.quiet);
  const Manifest& m = run.manifest();
  run.again = "firn resume " + options.target;
  if (m.status == "complete" && first > m.last) {
    run.progress().say("This run is complete.");
    std::cout << run.folder().path().string() << "\n";
    return ExitCode::ok;
  }
  if (m.pictures) run.renderer = make_renderer(run.scene(), kernels);
  if (m.snow_from.empty()) {
    run.simulated = make_snow(run.scene(), kernels, m.force);
    restore(run, *run.simulated, first);
  } else {
    run.recorded = std::make_unique<RecordedSnow>(m.snow_from);
  }
  run.expected_seconds = expected_frame_seconds(run.scene(), run.simulated.get(), m.pictures, m.threads);
  run.progress().say(run.scene().name + ": resuming at frame " + std::to_string(first) + " of " +
                     std::to_string(m.first) + "-" + std::to_string(m.last));
  const ExitCode code = run.produce(first, m.last, stop_flag());
  std::cout << run.folder().path().string() << "\n";
  return code;
}

}  // namespace firn
