// SPDX-License-Identifier: MIT
// What the ways in which a session begins have in common.
#pragma once
#include <memory>
#include <string>

#include "src/session/session.h"

namespace firn {

// The simulation of a scene on `kernels`, and the renderer of its pictures.
std::unique_ptr<SimulatedSnow> make_snow(const SceneConfig& scene, const kernels::KernelTable& kernels,
                                         bool force);
std::unique_ptr<FrameTracer> make_tracer(const SceneConfig& scene, const kernels::KernelTable& kernels);

// The instruction set with which a run goes on. Errors: usage Error if its bits would be others.
std::string isa_of(const SessionOptions& options, const Manifest& manifest);
// Says so if another build of firn goes on with a run.
void tell_of_other_build(Session::State& run);

// Errors: usage Error for pictures that are too large for the movie that can be made here.
void require_movie(const SceneConfig& scene);

// A first guess of one frame's time, s: work counted from the scene and usual rates of one thread. Only shown
// until two frames have been timed.
double expected_frame_seconds(const SceneConfig& scene, const SimulatedSnow* snow, bool pictures,
                              int threads);

// The manifest of a run that begins now, with this machine and program filled in.
Manifest new_manifest(const SessionOptions& options, const SceneConfig& scene, const std::string& isa);

// The same number. Errors: usage Error below 0.
int require_threads(int threads);
// Errors: usage Error for options that no session can have.
void require_options(const SessionOptions& options);

// The index of a collider that is to be driven. Errors: usage Error for a name that none has, or a driver
// that is empty.
std::size_t collider_number(const SceneConfig& scene, const std::string& name, const ColliderDriver& driver);

// Errors: usage Error at `where` for text that a manifest cannot hold.
void require_utf8(const std::string& text, const std::string& where);

}  // namespace firn
