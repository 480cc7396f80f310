// SPDX-License-Identifier: MIT
// A scene run as the program `firn` runs it: frames simulated and traced at the same time, checkpoints, a
// manifest that always tells the truth, and a run folder that can be gone on with after any interruption.
#pragma once
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "firn/driver.h"
#include "firn/export.h"
#include "firn/observer.h"
#include "firn/scene.h"

namespace firn {

// Errors about an option have its name as their place: "frames: ...".
struct SessionOptions {
  std::optional<std::string> out = {};             // the run folder; empty: out/NAME of the scene
  std::optional<std::pair<int, int>> frames = {};  // both included; empty: all
  // What a new run makes.
  bool pictures = true;
  bool particles = false;       // true: keeps them whatever the scene says
  bool movie = true;            // false: makes none whatever the scene says
  int threads = 0;              // 0: as many as the machine has
  std::string isa = "auto";     // base, x86-64-v3, x86-64-v4, or the best that the CPU has
  bool overlap = true;          // simulates the next frame while one is traced; the bits are the same without
  bool force = false;           // whatever the solver was not made for
  bool overwrite = false;       // a run that is in the folder already, or its pictures
  std::string command = "api";  // how the session was asked for, for the manifest
};

// How run() ended, when it did not throw.
struct SessionResult {
  bool interrupted = false;              // by a requested stop
  bool nothing_to_do = false;            // the run was complete already
  int kept = 0;                          // finished frames of the run, where it was interrupted
  std::vector<int> left;                 // and those that are still to be made, ascending
  std::vector<StageInterval> intervals;  // what each thread did, stage by stage
};

// What begins a session checks all that was asked for and takes the folder, so that a mistake leaves nothing
// behind; run() does the work. A session may be begun in one thread and run in another, but is not to be used
// by two at a time. Sessions of different folders may run at the same time; none changes a setting of the
// process. The observer must outlive its session.
class FIRN_API Session {
 public:
  // A new run of a scene. Errors: usage Error for a scene or options that no run can be made of, io Error.
  static Session start(const Scene& scene, const SessionOptions& options = {}, Observer& observer = silent());

  // Goes on with a run where it stopped, whatever stopped it: finished frames are kept, the simulation goes
  // on from a checkpoint, or from the start if none fits, with the same bits either way. Errors: usage or io
  // Error.
  static Session resume(const std::string& run, const SessionOptions& options = {},
                        Observer& observer = silent());

  // Pictures of the particles that a run kept: into its own folder, which several sessions may do at the same
  // time, or, with `out`, as a run of its own, for which `changes` may give other values of the scene.
  // Errors: usage or io Error.
  static Session render(const std::string& run, const SessionOptions& options = {},
                        const ReadOptions& changes = {}, Observer& observer = silent());

  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  // The named collider moves as `driver` says, from the start of the simulation: as Simulation::drive(), but
  // that the driver is called by a thread of the session. Before run(). The run remembers which colliders are
  // driven: resume() goes on only when they are driven again, by drivers that do the same, from the time of
  // the checkpoint that it goes on from, which their first call tells. Errors: usage Error for a name that no
  // collider has, one with a 'motion' of the scene, one that was not driven when the run began; after run().
  void drive(const std::string& collider, ColliderDriver driver);

  // Makes the frames, then the movie of all; once. When a stop is requested the finished frames are kept and
  // a checkpoint is written. Errors: io or unstable Error, or whatever the observer or a driver throws,
  // after the manifest has recorded it; usage Error for a second time, and, before anything is done, for a
  // collider that was driven and is not.
  SessionResult run(const std::stop_token& stop = {});

  std::string folder() const;  // of the run
  bool shares() const;         // whether other sessions may add pictures to the folder at the same time
  void tell(const std::string& line);  // to the observer and, once run() has begun, to the log of the run

  struct State;  // src/session/session.h

 private:
  explicit Session(std::unique_ptr<State> state);
  static Observer& silent();

  std::unique_ptr<State> state_;
};

}  // namespace firn
