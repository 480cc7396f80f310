// SPDX-License-Identifier: MIT
// One session of a run: snow from its source, pictures from the renderer, files into the folder, and the
// manifest that always tells the truth about them. New runs, resumed runs and renderings of recorded snow
// differ only in how they fill in a Production.
#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "src/app/options.h"
#include "src/app/progress.h"
#include "src/app/shared_frames.h"
#include "src/app/snow_source.h"
#include "src/core/error.h"
#include "src/graph/frame_graph.h"
#include "src/io/log.h"
#include "src/io/manifest.h"
#include "src/io/metrics_csv.h"
#include "src/io/run_folder.h"
#include "src/render/renderer.h"
#include "src/scene/scene.h"

namespace firn {

class Production {
 public:
  Production(RunFolder folder, SceneConfig scene, Manifest manifest, bool quiet);

  // What to show, and with what; `simulated` or `recorded` must be given, a renderer only if the run makes
  // pictures.
  std::unique_ptr<SimulatedSnow> simulated;
  std::unique_ptr<RecordedSnow> recorded;
  std::unique_ptr<Renderer> renderer;
  double expected_seconds = 0;  // of one frame, for the first guess of the time left
  std::string again;  // the command that continues this run when it is interrupted; of shared frames
                      // without their range
  // Given where recorded snow is shown in its own folder: only pictures are added, and others may do so too.
  std::unique_ptr<SharedFrames> shared;

  // Produces these frames (ascending), then the movie of all. Interrupted: finished frames are kept and a
  // checkpoint is written. Errors come out after the manifest has recorded them.
  ExitCode produce(const std::vector<int>& frames, std::atomic<bool>& stop);
  // Of a complete run: writes again what the manifest knows, and sweeps.
  void repair();

  const RunFolder& folder() const { return folder_; }
  const SceneConfig& scene() const { return scene_; }
  Manifest& manifest() { return manifest_; }
  Progress& progress() { return progress_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct InFlight {
    FrameRecord record;
    std::optional<Checkpoint> checkpoint;
    double bytes_per_particle = 0;
  };

  bool simulate(int frame, FrameSlot& slot, const std::atomic<bool>& stop);
  bool trace(int frame, FrameSlot& slot, const std::atomic<bool>& stop);
  bool write(int frame, FrameSlot& slot);
  void write_pictures(const FrameSlot& slot, FrameRecord& record);
  void write_particles(const FrameSlot& slot, FrameRecord& record);
  void begin(const std::vector<int>& frames);
  void begin_new();
  void go_on(const std::vector<int>& frames);
  void write_tables();
  ExitCode finish(FrameGraphResult result, const std::atomic<bool>& stop);
  FrameGraphResult run_graph(const std::vector<int>& frames, std::atomic<bool>& stop);
  FrameGraphResult run_shared(std::atomic<bool>& stop);
  void keep_pictures(FrameRecord& record) const;
  void finish_frame(InFlight job);
  void save_manifest(const std::string& status);
  void save_checkpoint(Checkpoint checkpoint);
  void save_position(std::vector<Snapshot> pending);
  void make_movie(const std::atomic<bool>& stop);
  ExitCode interrupted(FrameGraphResult result);
  void fail(const std::string& what);

  RunFolder folder_;
  SceneConfig scene_;
  Manifest manifest_;
  Log log_;
  Progress progress_;
  std::optional<MetricsCsv> metrics_;
  std::mutex mutex_;
  std::set<int> left_;                 // frames that are to be made
  std::map<int, FrameRecord> lost_;    // what was known of those whose snow is made again
  std::map<int, InFlight> in_flight_;  // frames between their simulate and the end of their write
  const double earlier_wall_;
  const Clock::time_point started_ = Clock::now();
  Clock::time_point manifest_saved_;
};

// The manifest of a run that begins now, with this machine and program filled in.
Manifest new_manifest(const Options& options, const SceneConfig& scene, const std::string& isa);

// Errors: usage Error at `where` for text that a manifest cannot hold.
void require_utf8(const std::string& text, const std::string& where);

// The files that a scene names, as they are now: absolute path and hash of the bytes. Errors: io Error for
// one that cannot be read.
std::vector<std::pair<std::string, std::string>> hash_inputs(const SceneConfig& scene);

}  // namespace firn
