// SPDX-License-Identifier: MIT
// The ways in which a session begins. Each checks all that was asked for and takes the folder, so that a
// mistake leaves nothing behind, and hands back a session that has written nothing yet.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "src/scene/scene.h"
#include "src/session/session.h"

namespace firn {

struct SessionOptions {
  std::string command;  // how the session was asked for, for the manifest
  std::string isa = "auto";
  int threads = 0;  // 0: all
  bool overlap = true;
  bool force = false;                         // whatever the solver was not made for
  bool overwrite = false;                     // a run that is in the folder already, or its pictures
  std::optional<std::string> out;             // the folder; empty: out/NAME of the scene
  std::optional<std::pair<int, int>> frames;  // both included
};

struct RunKind {
  bool pictures = true;
  bool particles = false;  // kept whatever the scene says
  bool movie = true;
  std::optional<std::pair<int, int>> frames;  // used when the options have none; empty: all
};

// A new run of a scene. Errors: usage Error for a scene or options that no run can be made of, io Error.
std::unique_ptr<Session> start_session(SceneConfig scene, const RunKind& kind, const SessionOptions& options,
                                       Observer& observer);

// Goes on with a run where it stopped, whatever stopped it: finished frames are kept, the simulation goes on
// from a checkpoint, or from the start if none fits, with the same bits either way. Errors: usage or io
// Error.
std::unique_ptr<Session> resume_session(const std::string& run, const SessionOptions& options,
                                        Observer& observer);

// Pictures of the particles that a run kept: into its own folder or, with `out`, as a run of its own, for
// which `reading` may change values of the scene. Errors: usage or io Error.
std::unique_ptr<Session> render_session(const std::string& run, const ReadOptions& reading,
                                        const SessionOptions& options, Observer& observer);

}  // namespace firn
