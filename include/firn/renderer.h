// SPDX-License-Identifier: MIT
// Pictures of snow, wherever it comes from: a simulation, points of another program, a file of a run.
#pragma once
#include <memory>
#include <stop_token>
#include <string>

#include "firn/export.h"
#include "firn/picture.h"
#include "firn/scene.h"
#include "firn/snapshot.h"

namespace firn {

// How a renderer works.
struct RendererOptions {
  int threads = 0;           // 0: as many as the machine has
  std::string isa = "auto";  // base, x86-64-v3, x86-64-v4, or the best that the CPU has
};

// The camera, lights, surfaces and objects of a scene, and the look of its snow. Not to be used by two
// threads at a time; several renderers may be, each with its own threads. The same snapshot and scene give
// the same bits on any number of threads.
class FIRN_API Renderer {
 public:
  // Errors: usage Error for a scene or options that no picture can be made of,
  // io Error.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  // The snow at its time, which decides too where what moves is; Snapshot::frame decides the noise, as it
  // does from frame to frame of a movie. Errors: usage Error for snow of an object that the scene does not
  // have, or a driven collider that it does not have; unstable Error for values that are not finite, for
  // volumes or densities that are not above 0; interrupted Error when a stop was requested.
  Picture render(const Snapshot& snapshot, const std::stop_token& stop = {});
  // Into memory that is there. False if a stop was requested: the picture is then unfinished. Errors: as
  // above.
  bool render(const Snapshot& snapshot, Picture& out, const std::stop_token& stop = {});

  // That of the scene: output.exposure and output.tone_map.
  ToneMapping tone_mapping() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace firn
