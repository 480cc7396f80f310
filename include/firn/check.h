// SPDX-License-Identifier: MIT
// What a scene will take and show, found before it is run: its snow is placed, and the first frame and the
// first steps are made in part.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firn/error.h"
#include "firn/export.h"
#include "firn/metrics.h"
#include "firn/scene.h"
#include "firn/vector.h"

namespace firn {

// How a scene is checked.
struct CheckOptions {
  int threads = 0;           // 0: as many as the machine has
  std::string isa = "auto";  // base, x86-64-v3, x86-64-v4, or the best that the CPU has
  bool force = false;        // a fixed dt above the stable bound
};

// A [[snow]] of the scene as it was placed.
struct CheckedSnow {
  std::string name;           // as in the scene, or "snow0" by its index
  std::size_t particles = 0;  // how many
  double mass = 0;            // kg
  double volume = 0;          // m^3
  double particle_mass = 0;   // kg, of each particle
  Vector3 bounds_min{};       // m, of particle centres
  Vector3 bounds_max{};       // m
  double pixel_fraction = 0;  // of frame 0: where the camera sees it
};

// A thing that is seen: the ground, a collider or an [[object]].
struct CheckedObject {
  std::string name;           // "the ground", or as errors call it
  double pixel_fraction = 0;  // of frame 0
};

// What snow may do that looks like a mistake.
enum class WarningKind {
  unseen,         // the camera sees nothing of it in frame 0
  floating,       // it is at rest, and what it could lie on is away
  sparse_points,  // points of a file, too few in a cell of the grid to hold together
  odd_points,     // points of a file whose volume is not that of the room that they have
  buried,         // a part of it is under the surface of the ground, a collider or an object
};

// A warning about one [[snow]].
struct SceneWarning {
  WarningKind kind = WarningKind::unseen;  // what the snow may do
  std::size_t snow = 0;                    // its index in the scene
  std::string place;  // where the scene says it: "scene.toml:12:1", or the line of the program
  std::string text;   // a line for people
};

// Both included.
struct StepRange {
  std::uint64_t low = 0;   // all steps as long as at the start
  std::uint64_t high = 0;  // all as short as where snow is packed most
};

// What a run holds at once. It is found by holding it: what the process held before counts too.
struct MemoryEstimate {
  std::uint64_t at_start = 0;     // bytes, of the process while frame 0 is made
  std::uint64_t peak_low = 0;     // bytes; the most that the process holds lies between the two
  std::uint64_t peak_high = 0;    // bytes
  std::uint64_t simulation = 0;   // bytes, the part of the simulation: its particles and its grid
  double bytes_per_particle = 0;  // that part, by particle
};

// All that was found.
struct CheckReport {
  std::string scene;                   // its name
  std::string file;                    // where it was read from; "scene": it was made in code
  std::vector<CheckedSnow> snow;       // as in the scene
  std::size_t particles = 0;           // of all snow
  double mass = 0;                     // kg, of all snow
  double dx = 0;                       // m, grid spacing
  std::size_t grid_blocks = 0;         // of 4x4x4 nodes, at the start
  TimeStep step;                       // the first; its cause is what limits it where the scene fixes no dt
  bool fixed_dt = false;               // by the scene
  double shortest_dt = 0;              // s, where snow is packed most
  int frames = 0;                      // of the run
  double frame_seconds = 0;            // s of the simulation, from one frame to the next
  StepRange steps_per_frame;           // of the simulation
  StepRange steps;                     // of all frames
  int width = 0;                       // pixels, of a picture
  int height = 0;                      // pixels
  int samples = 0;                     // a pixel
  int max_bounces = 0;                 // of a path
  std::vector<SceneWarning> warnings;  // those of one kind in the scene's order
  // What the first steps blew up with, an unstable Error. Nothing is known then of what follows, and of snow
  // that is unseen.
  std::optional<Error> blow_up = {};
  MemoryEstimate memory;               // of a run in a process like this
  std::vector<CheckedObject> objects;  // as the scene has them
  double background_fraction = 0;      // of frame 0's pixels: sky and lamps
};

// Errors: those with which a run of the scene would be refused: usage Error for a scene or options that no
// run can be made of, io Error for files that cannot be read. Thread-safe: each call has threads of its own.
// Everything but `memory` is the same for any number of threads.
FIRN_API CheckReport check_scene(const Scene& scene, const CheckOptions& options = {});

}  // namespace firn
