// SPDX-License-Identifier: MIT
// The stages of the frame graph as this program fills them, and what is on disk after each way a session can
// end. A frame counts as finished when the journal has it; its line is written after the frame's files and
// before a checkpoint that relies on it, so a power cut at any point leaves a run that can be resumed.
#include "src/session/session.h"

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

#include "src/core/text.h"
#include "src/graph/trace.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"
#include "src/io/images.h"
#include "src/io/journal.h"
#include "src/io/movie.h"
#include "src/io/particle_file.h"
#include "src/io/program.h"
#include "src/scene/name.h"

namespace firn {
namespace {

constexpr auto kManifestEvery = std::chrono::seconds(1);
constexpr int kCheckpointsKept = 3;
constexpr auto kLookAgain = std::chrono::milliseconds(200);  // whether another process has finished a frame

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

Observer::~Observer() = default;

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

SessionResult Session::run(const std::stop_token& stop) {
  state_->require_drivers();
  if (std::exchange(state_->has_run, true))
    throw Error(ErrorCode::usage, folder(), "this session has run already; resume() begins the next one");
  return state_->run(stop);
}
std::string Session::folder() const { return state_->folder().path().string(); }
bool Session::shares() const { return state_->shared != nullptr; }
void Session::tell(const std::string& line) { state_->tell(line); }

Observer& Session::silent() {
  static Observer observer;
  return observer;
}

Session::State::State(RunFolder folder, SceneConfig scene, Manifest manifest, Observer& observer)
    : folder_(std::move(folder)),
      scene_(std::move(scene)),
      manifest_(std::move(manifest)),
      observer_(observer),
      threads_(manifest_.threads),
      earlier_wall_(manifest_.wall_seconds) {}

void Session::State::tell(const std::string& line) {
  log_.add(line);
  observer_.message(line);
}

void Session::State::begin() {
  left_ = {frames.begin(), frames.end()};
  if (shared) {
    log_.open(folder_.log());
  } else if (folder_.opened()) {
    go_on();
  } else {
    begin_new();
  }
  log_.add(manifest_.command);
}

// The manifest comes first, in one move: from then on the folder is this run's, whatever happens next.
void Session::State::begin_new() {
  folder_.lock();
  save_manifest("starting");
  folder_.clear();
  folder_.begin();
  replace_journal(folder_.journal(), manifest_.key(), {});
  write_tables();
  save_manifest("running");
  folder_.keep();
  log_.open(folder_.log());
}

// Whatever cannot be written is found before anything is changed. The lines of frames that are made again
// stay in the journal until they have others: they know of pictures that were added, and if no frame can be
// made now nothing is lost.
void Session::State::go_on() {
  folder_.lock();
  log_.open(folder_.log());
  folder_.begin();
  // Before the manifest, in which version 0.1 kept the frames.
  replace_journal(folder_.journal(), manifest_.key(), manifest_.frames);
  const auto is_lost = [&](const FrameRecord& record) {
    return std::binary_search(frames.begin(), frames.end(), record.frame) &&
           !(recorded && recorded->has(record.frame));
  };
  for (FrameRecord& record : manifest_.frames) {
    if (is_lost(record)) lost_[record.frame] = record;
  }
  std::erase_if(manifest_.frames, is_lost);
  manifest_.error.clear();
  save_manifest("running");
  write_tables();
}

// What the manifest holds too, for people and other programs.
void Session::State::write_tables() {
  write_file(folder_.scene(), manifest_.scene);
  metrics_.emplace(folder_.metrics());
  metrics_->replace(manifest_.frames);
}

void Session::State::repair() {
  folder_.lock();
  folder_.begin();
  write_tables();
}

SessionResult Session::State::run(const std::stop_token& stop) {
  return threads_.run([&] { return make_all(stop); });
}

SessionResult Session::State::make_all(const std::stop_token& stop) {
  if (nothing_to_do) {
    repair();
    SessionResult complete;
    complete.nothing_to_do = true;
    return complete;
  }
  begin();
  try {
    return finish(shared ? run_shared(stop) : run_graph(frames, stop), stop);
  } catch (const Error& error) {
    observer_.frames_end();
    if (error.code() == ErrorCode::interrupted) return interrupted({});
    fail(error.what());
    throw;
  } catch (const std::exception& error) {
    observer_.frames_end();
    fail(error.what());
    throw;
  }
}

SessionResult Session::State::finish(FrameGraphResult result, const std::stop_token& stop) {
  if (result.interrupted) return interrupted(std::move(result));
  if (!shared) folder_.require_lock();
  if (metrics_) metrics_->replace(manifest_.frames);  // frames that were made again belong between others
  make_movie(stop);
  save_manifest("complete");
  if (shared) {  // what others made too
    manifest_.frames = read_journal(folder_.journal(), manifest_.key());
    manifest_.pictures = true;
  }
  SessionResult done;
  done.intervals = std::move(result.intervals);
  return done;
}

FrameGraphResult Session::State::run_graph(const std::vector<int>& wanted, const std::stop_token& stop) {
  if (wanted.empty()) return {};
  FrameStages stages;
  stages.simulate = [&](int frame, FrameSlot& slot, const std::stop_token& stop) {
    return simulate(frame, slot, stop);
  };
  stages.trace = [&](int frame, FrameSlot& slot, const std::stop_token& stop) {
    return trace(frame, slot, stop);
  };
  stages.write = [&](int frame, FrameSlot& slot) { return write(frame, slot); };
  if (shared) stages.claim = [&](int frame) { return shared->claim(frame); };
  observer_.frames_begin(static_cast<int>(wanted.size()), expected_seconds);
  FrameGraphResult result = run_frames(stages, {wanted, manifest_.slots}, stop);
  observer_.frames_end();
  if (!shared) {
    folder_.require_lock();
    write_file(folder_.trace(), chrome_trace(result.intervals));
  }
  return result;
}

// Frames that others have claimed are waited for, and made here after all if they are given back unfinished.
FrameGraphResult Session::State::run_shared(const std::stop_token& stop) {
  FrameGraphResult all;
  bool waits = false;
  for (std::vector<int> left = shared->left(); !left.empty() && !all.interrupted; left = shared->left()) {
    if (std::any_of(left.begin(), left.end(), [&](int frame) { return shared->claim(frame); })) {
      FrameGraphResult some = run_graph(left, stop);
      all.interrupted = some.interrupted;
      if (some.intervals.size() > all.intervals.size()) all.intervals = std::move(some.intervals);
      continue;
    }
    if (!std::exchange(waits, true))
      tell("Other processes are rendering frames " + frame_list(left) + ": waiting for them.");
    std::this_thread::sleep_for(kLookAgain);
    all.interrupted = stop.stop_requested();
  }
  return all;
}

bool Session::State::simulate(int frame, FrameSlot& slot, const std::stop_token& stop) {
  const Stopwatch watch;
  observer_.stage_begins(Stage::simulate, frame);
  InFlight job;
  const bool is_recorded = !simulated || (recorded && recorded->has(frame));
  SnowSource& source = is_recorded ? static_cast<SnowSource&>(*recorded) : *simulated;
  if (!source.fetch(frame, slot.snapshot, job.record, stop)) return false;
  job.record.frame = frame;
  const int every = scene_.output.checkpoint_every;
  if (!is_recorded && every > 0 && frame > manifest_.first && frame < manifest_.last && frame % every == 0 &&
      simulated->reached() == frame) {
    job.checkpoint = simulated->checkpoint();
  }
  if (simulated) job.bytes_per_particle = simulated->bytes_per_particle();
  if (!is_recorded) job.record.simulate_seconds += watch.seconds();
  const std::lock_guard lock(mutex_);
  in_flight_[frame] = std::move(job);
  observer_.stage_ends(Stage::simulate, frame);
  return true;
}

bool Session::State::trace(int frame, FrameSlot& slot, const std::stop_token& stop) {
  if (!renderer) return !stop.stop_requested();
  const Stopwatch watch;
  observer_.stage_begins(Stage::trace, frame);
  RenderStats stats;
  if (!renderer->render(slot.snapshot, slot.picture, stats, stop)) return false;
  std::string integrator = name_of(stats.choice.integrator);
  if (!stats.choice.why.empty()) {
    integrator += ": " + stats.choice.why;
    tell("Frame " + std::to_string(frame) + " by " + integrator);
  }
  const std::lock_guard lock(mutex_);
  in_flight_[frame].record.integrator = integrator;
  in_flight_[frame].record.trace_seconds = watch.seconds();
  in_flight_[frame].record.choice_seconds = stats.pilot_seconds;
  in_flight_[frame].record.rays = stats.rays;
  in_flight_[frame].record.mean_samples = stats.mean_samples;
  in_flight_[frame].record.snow_mass = stats.snow_mass;
  in_flight_[frame].record.medium_mass = stats.medium_mass;
  observer_.stage_ends(Stage::trace, frame);
  return true;
}

bool Session::State::write(int frame, FrameSlot& slot) {
  const Stopwatch watch;
  observer_.stage_begins(Stage::write, frame);
  InFlight job;
  {
    const std::lock_guard lock(mutex_);
    job = std::move(in_flight_[frame]);
  }
  folder_.require_lock();
  job.record.files.clear();
  write_particles(slot, job.record);
  if (renderer) write_pictures(slot, job.record);
  if (metrics_) metrics_->add(frame, job.record.metrics);
  job.record.write_seconds = watch.seconds();
  finish_frame(std::move(job));
  if (shared) shared->release(frame);
  const std::lock_guard lock(mutex_);
  in_flight_.erase(frame);
  observer_.stage_ends(Stage::write, frame);
  return true;
}

// Pictures that were added to a run which makes none are still those of its snow when that is made again.
void Session::State::keep_pictures(FrameRecord& record) const {
  const auto lost = lost_.find(record.frame);
  if (renderer || lost == lost_.end() || lost->second.particles_hash != record.particles_hash) return;
  FrameRecord kept = lost->second;
  kept.simulate_seconds = record.simulate_seconds;
  kept.write_seconds = record.write_seconds;
  record = std::move(kept);
}

void Session::State::finish_frame(InFlight job) {
  keep_pictures(job.record);
  folder_.require_lock();
  append_journal(folder_.journal(), manifest_.key(), job.record);
  const int frame = job.record.frame;
  auto& frames = manifest_.frames;
  const auto place = std::lower_bound(frames.begin(), frames.end(), job.record.frame,
                                      [](const FrameRecord& a, int frame) { return a.frame < frame; });
  if (place != frames.end() && place->frame == job.record.frame) {
    *place = std::move(job.record);
  } else {
    frames.insert(place, std::move(job.record));
  }
  left_.erase(frame);
  manifest_.bytes_per_particle = std::max(manifest_.bytes_per_particle, job.bytes_per_particle);
  if (Clock::now() - manifest_saved_ > kManifestEvery) save_manifest("running");
  if (job.checkpoint) save_checkpoint(std::move(*job.checkpoint));
}

void Session::State::write_pictures(const FrameSlot& slot, FrameRecord& record) {
  record.picture_hash = hash_in_hex(
      {reinterpret_cast<const char*>(slot.picture.rgb.data()), slot.picture.rgb.size() * sizeof(float)});
  const ToneMapping tone{scene_.output.exposure, scene_.output.tone_map};
  for (const auto& format : scene_.output.formats) {
    for (const PictureFile& file : encode_picture(slot.picture, format, tone)) {
      const auto path = folder_.frame(record.frame, file.extension);
      write_file(path, file.bytes);
      record.files.emplace_back(path.lexically_relative(folder_.path()).string(), hash_in_hex(file.bytes));
    }
  }
}

void Session::State::write_particles(const FrameSlot& slot, FrameRecord& record) {
  const std::string bytes = encode_snapshot(slot.snapshot);
  record.particles_hash = hash_in_hex(bytes);
  if (!manifest_.particles) return;
  const auto path = folder_.particle_file(record.frame);
  if (!shared) write_file(path, bytes);
  record.files.emplace_back(path.lexically_relative(folder_.path()).string(), record.particles_hash);
}

void Session::State::save_manifest(const std::string& status) {
  if (shared) return;  // it is the run's, which adding pictures does not change
  folder_.require_lock();
  manifest_.status = status;
  manifest_.wall_seconds = earlier_wall_ + std::chrono::duration<double>(Clock::now() - started_).count();
  write_manifest(folder_.manifest(), manifest_);
  manifest_saved_ = Clock::now();
}

void Session::State::save_checkpoint(Checkpoint checkpoint) {
  folder_.require_lock();
  checkpoint.scene_hash = hash_bytes(manifest_.scene.data(), manifest_.scene.size());
  write_checkpoint(folder_.checkpoint(checkpoint.frame), checkpoint);
  // Later ones stay: frames before them may be made again, and then they count again.
  int kept = 0;
  for (const int frame : folder_.saved_checkpoints()) {
    std::error_code ignored;  // one too many does no harm
    if (frame <= checkpoint.frame && ++kept > kCheckpointsKept)
      std::filesystem::remove(folder_.checkpoint(frame), ignored);
  }
}

// Where the simulation stands, between two steps, with the frames that it had passed but that were not
// written.
void Session::State::save_position(std::vector<Snapshot> pending) {
  Checkpoint checkpoint = simulated->checkpoint();
  std::vector<PendingFrame> frames;
  frames.reserve(pending.size() + checkpoint.pending.size());
  for (Snapshot& snow : pending) {
    if (snow.frame <= checkpoint.frame)  // others were read from their files
      frames.push_back({in_flight_.at(snow.frame).record, std::move(snow)});
  }
  std::move(checkpoint.pending.begin(), checkpoint.pending.end(), std::back_inserter(frames));
  checkpoint.pending = std::move(frames);
  save_manifest("interrupted");
  save_checkpoint(std::move(checkpoint));
}

void Session::State::make_movie(const std::stop_token& stop) {
  const auto& formats = scene_.output.formats;
  const auto has = [&](const char* format) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  if (!renderer || shared || !manifest_.wants_movie || !(has("png") || has("ppm")) ||
      manifest_.last == manifest_.first)
    return;
  const MovieJob job{folder_.frames(), has("png") ? "png" : "ppm",
                     manifest_.first,  manifest_.last,
                     scene_.time.fps,  folder_.movie()};
  const bool ffmpeg = find_program("ffmpeg").has_value();
  tell(ffmpeg ? "Making the movie with ffmpeg." : "Making the movie.");
  const std::filesystem::path movie = ffmpeg ? make_mp4(job, stop) : make_webp(job, stop);
  manifest_.movie = movie.filename().string();
  manifest_.movie_hash = hash_in_hex(read_file(movie));
  std::error_code ignored;  // a movie of the other kind, made before, does not show these pictures
  for (const char* kind : {".mp4", ".webp"}) {
    if (movie.extension() != kind) std::filesystem::remove(job.out.string() + kind, ignored);
  }
  if (!ffmpeg)
    tell("No ffmpeg on the PATH: it is an animated WebP. An mp4 comes from\n  " +
         shell_line(ffmpeg_command(job)));
}

SessionResult Session::State::interrupted(FrameGraphResult result) {
  if (simulated) {
    save_position(std::move(result.pending));
  } else {
    save_manifest("interrupted");
  }
  if (metrics_) metrics_->replace(manifest_.frames);
  SessionResult stopped;
  stopped.interrupted = true;
  stopped.kept = static_cast<int>(std::count_if(
      manifest_.frames.begin(), manifest_.frames.end(),
      [&](const FrameRecord& r) { return !left_.count(r.frame) && (!renderer || !r.picture_hash.empty()); }));
  // Others may have rendered the rest of shared frames meanwhile.
  stopped.left = shared ? shared->left() : std::vector<int>(left_.begin(), left_.end());
  return stopped;
}

void Session::State::fail(const std::string& what) {
  manifest_.error = what;
  log_.add("failed: " + what);
  try {
    save_manifest("failed");
  } catch (const Error& error) {  // the disk is full, perhaps; `what` says why already
    log_.add(error.what());
  }
}

}  // namespace firn
