// SPDX-License-Identifier: MIT
// run.json: what made this run and how it stands; with the records of its frames (journal.h) enough to
// repeat, resume and compare it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "src/mpm/solver.h"

namespace firn {

struct FrameRecord {
  int frame = 0;
  double simulate_seconds = 0, trace_seconds = 0, write_seconds = 0;
  double choice_seconds = 0;  // of the tracing, what `auto` took to choose
  std::uint64_t rays = 0;
  double mean_samples = 0;           // a pixel
  double snow_mass = 0;              // kg, in pictures with light inside the snow
  double medium_mass = 0;            // kg, what of it light meets: the surface or the balls clip the rest
  std::string integrator;            // that made the picture; of auto, also why
  std::uint64_t particle_steps = 0;  // of this frame alone
  Metrics metrics;
  std::string particles_hash;                              // of the snapshot's columns
  std::string picture_hash;                                // of the linear picture; empty without one
  std::vector<std::pair<std::string, std::string>> files;  // path in the run folder, hash of its bytes
};

struct Manifest {
  // starting (files of a run that it replaces may still be there), running, complete, interrupted, failed
  std::string status = "running";
  std::string error;    // one line, when failed
  std::string command;  // as typed
  std::string version, revision, compiler, build_type, cpu, isa;
  int threads = 0;
  int slots = 0;
  bool force = false;
  std::uint64_t seed = 0;
  std::string started;      // UTC
  std::string id;           // of this run alone, however often its scene is run
  double wall_seconds = 0;  // of all sessions together
  int first = 0, last = 0;  // frames, included
  bool pictures = true;     // false: `firn simulate`
  bool particles = false;   // particle files are kept
  bool wants_movie = true;
  std::string snow_from;    // absolute path of the run whose particle files are shown; empty: simulated
  std::string snow_origin;  // of that run
  std::vector<std::string> driven;  // colliders that a program moves, ascending
  std::string scene_file;           // absolute path; other files that the scene names are relative to it
  std::string scene;                // resolved, as TOML
  std::string scene_hash;
  double bytes_per_particle = 0;    // of the simulation, grid included
  std::string movie;                // file name, empty if none
  std::string movie_hash;           // of its bytes
  std::vector<FrameRecord> frames;  // finished ones, in order
  std::vector<std::pair<std::string, std::string>>
      inputs;  // files that the scene names: absolute path, hash of its bytes

  // The lines of the journal are signed with it.
  std::string key() const { return scene_hash + started + id; }
  // What decides on the bits of the snow: the scene, whether its kernels are those of `base`, and the program
  // that drives a collider, of which nothing is known but the run.
  std::string origin() const {
    return scene_hash + (isa == "base" ? " base" : "") + (driven.empty() ? "" : " driven " + id);
  }
};

// All but the frames.
void write_manifest(const std::filesystem::path& path, const Manifest& manifest);
// With the frames of the journal, or, of a run of version 0.1, those in the manifest itself. Errors: io Error
// for a missing or damaged manifest: not JSON, without a field, frames that do not ascend or are not of the
// run, a scene that is not the one of its hash.
Manifest read_manifest(const std::filesystem::path& path, const std::filesystem::path& journal);
// The manifest and its frames as one JSON object.
void print_manifest(std::ostream& out, const Manifest& manifest);

// One record as JSON in one line, and back. Errors: io Error at `where` for anything else.
std::string encode_record(const FrameRecord& record);
FrameRecord decode_record(std::string_view json, const std::string& where);

}  // namespace firn
