// SPDX-License-Identifier: MIT
// firn::Renderer: a scene, the frame tracer made of it, and threads of its own.
#include "firn/renderer.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "firn/error.h"
#include "src/core/isa.h"
#include "src/core/threads.h"
#include "src/core/vector.h"
#include "src/render/frame_tracer.h"
#include "src/scene/scene.h"
#include "src/session/prepare.h"

namespace firn {
namespace {

FrameTracer make_frame_tracer(Threads& threads, const RendererOptions& options, const SceneConfig& scene) {
  return threads.run([&] { return FrameTracer(choose_kernels(options.isa), build_render(scene)); });
}

std::vector<std::string> names_of_snow(const SceneConfig& scene) {
  std::vector<std::string> names;
  for (const SnowConfig& snow : scene.snow) names.push_back("'" + snow.name + "'");
  return names;
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "none" : list;
}

[[noreturn]] void refuse_value(std::size_t i, const Snapshot& snapshot, const std::string& what) {
  throw Error(ErrorCode::unstable, "snapshot",
              "particle " + std::to_string(i) + " (id " + std::to_string(snapshot.id[i]) + ") has " + what);
}

// Of a program's own snapshots: positions are looked at by the render grid.
void check_particle(const Snapshot& snapshot, std::size_t i) {
  if (!(snapshot.volume0[i] > 0) || !std::isfinite(snapshot.volume0[i]))
    refuse_value(i, snapshot, "no volume0 above 0 m3");
  if (!(snapshot.density[i] > 0) || !std::isfinite(snapshot.density[i]))
    refuse_value(i, snapshot, "no density above 0 kg/m3");
  for (std::size_t k = 0; k < 3; ++k) {
    if (!std::isfinite(snapshot.velocity[k][i])) refuse_value(i, snapshot, "a velocity that is not finite");
  }
}

}  // namespace

struct Renderer::State {
  State(const SceneConfig& scene, const RendererOptions& options)
      : threads(require_threads(options.threads)),
        tracer(make_frame_tracer(threads, options, scene)),
        snow(names_of_snow(scene)),
        colliders(collider_names(scene)),
        tone{scene.output.exposure, scene.output.tone_map} {}

  void require(const Snapshot& snapshot) const;

  Threads threads;
  FrameTracer tracer;
  std::vector<std::string> snow, colliders;  // of the scene
  ToneMapping tone;
};

void Renderer::State::require(const Snapshot& snapshot) const {
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    if (snapshot.object[i] >= snow.size()) {
      throw Error(ErrorCode::usage, "snapshot",
                  "it has particles of snow number " + std::to_string(snapshot.object[i]) +
                      ", counted from 0, which the renderer's scene does not have (" + listed(snow) +
                      "); Simulation::scene() has what was added");
    }
    check_particle(snapshot, i);
  }
  for (const DrivenCollider& c : snapshot.driven) {
    const Vector3* const vectors[] = {&c.position, &c.velocity, &c.angular_velocity};
    bool finite = mat(c.rotation).allFinite() && std::isfinite(c.time);
    for (const Vector3* v : vectors) finite = finite && vec(*v).allFinite();
    const Mat3 rotation = mat(c.rotation);
    if (finite && (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0))
      throw Error(ErrorCode::usage, "snapshot",
                  "the rotation of the driven collider '" + c.name + "' is no rotation matrix");
    if (!finite)
      throw Error(ErrorCode::unstable, "snapshot",
                  "the driven collider '" + c.name + "' is not at a finite place");
    if (std::find(colliders.begin(), colliders.end(), c.name) != colliders.end()) continue;
    throw Error(
        ErrorCode::usage, "snapshot",
        "the driven collider '" + c.name + "' is not in the renderer's scene (" + listed(colliders) + ")");
  }
  for (const double x : snapshot.origin) {
    if (std::isfinite(x)) continue;
    throw Error(ErrorCode::unstable, "snapshot", "its origin is not finite");
  }
  if (!std::isfinite(snapshot.time)) throw Error(ErrorCode::usage, "snapshot", "its time is not finite");
}

Renderer::Renderer(const Scene& scene, const RendererOptions& options)
    : state_(std::make_unique<State>(config_of(scene), options)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

bool Renderer::render(const Snapshot& snapshot, Picture& out, const std::stop_token& stop) {
  state_->require(snapshot);
  RenderStats stats;
  return state_->threads.run([&] { return state_->tracer.render(snapshot, out, stats, stop); });
}

Picture Renderer::render(const Snapshot& snapshot, const std::stop_token& stop) {
  Picture picture;
  if (!render(snapshot, picture, stop))
    throw Error(ErrorCode::interrupted, "", "the picture was stopped before it was finished");
  return picture;
}

ToneMapping Renderer::tone_mapping() const { return state_->tone; }

}  // namespace firn
