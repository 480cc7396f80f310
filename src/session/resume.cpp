// SPDX-License-Identifier: MIT
// Continues a run where it stopped, whatever stopped it: finished frames are kept, the simulation goes on
// from the checkpoint, or from the start if none fits, with the same bits either way.
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <vector>

#include "src/core/isa.h"
#include "src/core/text.h"
#include "src/core/threads.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"
#include "src/session/prepare.h"
#include "src/session/verify.h"

namespace firn {
namespace {

// A checkpoint can be used if all the frames that it has passed and that are wanted are kept in it.
bool covers(const Checkpoint& checkpoint, const std::vector<int>& wanted) {
  return std::all_of(wanted.begin(), wanted.end(), [&](int frame) {
    const auto is_frame = [frame](const PendingFrame& pending) { return pending.snow.frame == frame; };
    return frame > checkpoint.frame ||
           std::any_of(checkpoint.pending.begin(), checkpoint.pending.end(), is_frame);
  });
}

// The latest that can be used. One that cannot be read is told of and passed over.
std::optional<Checkpoint> find_checkpoint(Session::State& run, const std::vector<int>& wanted) {
  const std::string& scene = run.manifest().scene;
  for (const int frame : run.folder().saved_checkpoints()) {
    try {
      Checkpoint checkpoint =
          read_checkpoint(run.folder().checkpoint(frame), hash_bytes(scene.data(), scene.size()));
      if (covers(checkpoint, wanted)) return checkpoint;
    } catch (const Error& error) {
      run.tell(std::string(error.what()) + "; it is not used");
    }
  }
  return std::nullopt;
}

void restore(Session::State& run, const std::vector<int>& wanted) {
  if (auto checkpoint = find_checkpoint(run, wanted)) {
    run.simulated->restore(std::move(*checkpoint), wanted);
  } else if (wanted.front() > 0) {
    run.tell("There is no checkpoint from before frame " + std::to_string(wanted.front()) +
             ": simulating again from the start.");
  }
}

// The snow of the frames that are to be made: of another run, of this run's own particle files, or simulated.
void find_snow(Session::State& run, const Unfinished& unfinished, const kernels::KernelTable& kernels) {
  const Manifest& m = run.manifest();
  if (!m.snow_from.empty()) {
    run.recorded = std::make_unique<RecordedSnow>(m.snow_from);
    run.recorded->require(m.snow_origin, m.frames);
    return;
  }
  std::vector<int> wanted;
  std::set_difference(unfinished.frames.begin(), unfinished.frames.end(), unfinished.kept.begin(),
                      unfinished.kept.end(), std::back_inserter(wanted));
  if (!unfinished.kept.empty()) {
    run.recorded = std::make_unique<RecordedSnow>(run.folder().path());
    run.recorded->keep_only(unfinished.kept);
  }
  if (wanted.empty()) return;
  run.simulated = make_snow(run.scene(), kernels, m.force);
  restore(run, wanted);
}

// Whether nothing is left to do.
bool is_complete(Session::State& run, const Unfinished& unfinished) {
  const Manifest& m = run.manifest();
  if (m.status != "complete" || !unfinished.frames.empty()) return false;
  if (m.movie.empty() || m.movie_hash.empty()) return true;
  const std::string fault = fault_of(run.folder().path() / m.movie, m.movie_hash);
  if (!fault.empty()) run.tell(fault + ": making it again.");
  return fault.empty();
}

std::unique_ptr<Session::State> begin_again(const std::string& target, const SessionOptions& options,
                                            Observer& observer) {
  require_options(options);
  RunFolder folder = RunFolder::open(target);
  folder.lock();
  Manifest manifest = read_manifest(folder.manifest(), folder.journal());
  if (manifest.status == "starting") folder.clear();
  require_scene(folder, manifest);
  const Unfinished unfinished = find_unfinished(folder, manifest);
  const std::string isa = isa_of(options, manifest);
  const auto& kernels = choose_kernels(isa);
  require_inputs_exist(manifest);
  SceneConfig scene = read_scene_text(manifest.scene, manifest.scene_file, {});
  require_inputs(manifest, scene);
  manifest.isa = kernels.isa;
  manifest.slots = options.overlap ? kSlots : 1;
  manifest.threads = Threads::count_of(options.threads);

  auto made =
      std::make_unique<Session::State>(std::move(folder), std::move(scene), std::move(manifest), observer);
  Session::State& run = *made;
  const Manifest& m = run.manifest();
  tell_of_other_build(run);
  if (const auto& damaged = unfinished.damaged; !damaged.empty()) {
    run.tell(unfinished.why + ": frame" + (damaged.size() == 1 ? " " : "s ") + frame_list(damaged) +
             (damaged.size() == 1 ? " is" : " are") + " made again.");
  }
  run.nothing_to_do = is_complete(run, unfinished);
  if (run.nothing_to_do) return made;
  run.frames = unfinished.frames;
  if (m.pictures) run.renderer = make_tracer(run.scene(), kernels);
  if (run.frames.empty()) {
    run.tell(run.scene().name + ": all frames are there");
    return made;
  }
  find_snow(run, unfinished, kernels);
  run.expected_seconds = expected_frame_seconds(run.scene(), run.simulated.get(), m.pictures, m.threads);
  run.tell(run.scene().name + ": resuming with frames " + frame_list(run.frames) + " of " +
           std::to_string(m.first) + "-" + std::to_string(m.last));
  return made;
}

}  // namespace

Session Session::resume(const std::string& run, const SessionOptions& options, Observer& observer) {
  return Session(Threads(options.threads).run([&] { return begin_again(run, options, observer); }));
}

}  // namespace firn
