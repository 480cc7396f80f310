// SPDX-License-Identifier: MIT
// One session of a run: snow from its source, pictures from the renderer, files into the folder, and the
// manifest that always tells the truth about them. New runs, resumed runs and renderings of recorded snow
// differ only in how they fill in the state (start.cpp, resume.cpp, render.cpp).
#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "firn/error.h"
#include "firn/session.h"
#include "src/core/threads.h"
#include "src/graph/frame_graph.h"
#include "src/io/log.h"
#include "src/io/manifest.h"
#include "src/io/metrics_csv.h"
#include "src/io/run_folder.h"
#include "src/render/frame_tracer.h"
#include "src/scene/scene.h"
#include "src/session/shared_frames.h"
#include "src/session/snow_source.h"

namespace firn {

struct Session::State {
 public:
  // The observer must outlive the session.
  State(RunFolder folder, SceneConfig scene, Manifest manifest, Observer& observer);

  // What to show, and with what; `simulated` or `recorded` must be given, a renderer only if the run makes
  // pictures.
  std::unique_ptr<SimulatedSnow> simulated;
  std::unique_ptr<RecordedSnow> recorded;
  std::unique_ptr<FrameTracer> renderer;
  double expected_seconds = 0;   // of one frame, for the first guess of the time left
  std::vector<int> frames;       // to be made, ascending
  std::set<std::string> driven;  // colliders that have a driver now
  bool has_run = false;
  bool nothing_to_do = false;  // of a complete run: only what the manifest knows is written again
  // Given where recorded snow is shown in its own folder: only pictures are added, and others may do so too.
  std::unique_ptr<SharedFrames> shared;

  // Makes the frames, then the movie of all; once. Interrupted: finished frames are kept and a checkpoint is
  // written. Errors come out after the manifest has recorded them. Not to be called from two threads.
  SessionResult run(const std::stop_token& stop);

  void drive(const std::string& collider, ColliderDriver driver);
  // Errors: usage Error if a collider of the run was driven and is not.
  void require_drivers() const;

  void tell(const std::string& line);  // the observer and, from the start of run() on, the log

  const RunFolder& folder() const { return folder_; }
  const SceneConfig& scene() const { return scene_; }
  Manifest& manifest() { return manifest_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct InFlight {
    FrameRecord record;
    std::optional<Checkpoint> checkpoint;
    double bytes_per_particle = 0;
  };

  bool simulate(int frame, FrameSlot& slot, const std::stop_token& stop);
  bool trace(int frame, FrameSlot& slot, const std::stop_token& stop);
  bool write(int frame, FrameSlot& slot);
  void write_pictures(const FrameSlot& slot, FrameRecord& record);
  void write_particles(const FrameSlot& slot, FrameRecord& record);
  void begin();
  void begin_new();
  void go_on();
  void write_tables();
  void repair();
  SessionResult make_all(const std::stop_token& stop);
  SessionResult finish(FrameGraphResult result, const std::stop_token& stop);
  FrameGraphResult run_graph(const std::vector<int>& wanted, const std::stop_token& stop);
  FrameGraphResult run_shared(const std::stop_token& stop);
  void keep_pictures(FrameRecord& record) const;
  void finish_frame(InFlight job);
  void save_manifest(const std::string& status);
  void save_checkpoint(Checkpoint checkpoint);
  void save_position(std::vector<Snapshot> pending);
  void make_movie(const std::stop_token& stop);
  SessionResult interrupted(FrameGraphResult result);
  void fail(const std::string& what);

  RunFolder folder_;
  SceneConfig scene_;
  Manifest manifest_;
  Observer& observer_;
  Threads threads_;
  Log log_;
  std::optional<MetricsCsv> metrics_;
  std::mutex mutex_;
  std::set<int> left_;                 // frames that are to be made
  std::map<int, FrameRecord> lost_;    // what was known of those whose snow is made again
  std::map<int, InFlight> in_flight_;  // frames between their simulate and the end of their write
  const double earlier_wall_;
  const Clock::time_point started_ = Clock::now();
  Clock::time_point manifest_saved_;
};

}  // namespace firn
