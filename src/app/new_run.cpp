// SPDX-License-Identifier: MIT
#include "src/app/new_run.h"

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "src/app/interrupt.h"
#include "src/app/report.h"
#include "src/core/error.h"
#include "src/core/isa.h"
#include "src/io/exr.h"
#include "src/io/program.h"
#include "src/io/version.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// Rates of one thread, rounded down from what settled scenes reach; see docs/ for measured ones.
constexpr double kParticleStepsPerSecond = 10e6;
constexpr double kRaysPerSecond = 4e6;
constexpr int kMostWebpPixels = 16383;
constexpr double kRaysPerPath = 3;  // most paths end at the sky early

void set_frames(Manifest& manifest, const SceneConfig& scene,
                const std::optional<std::pair<int, int>>& frames) {
  if (!frames) return;
  if (frames->second >= scene.time.frames) {
    throw Error(
        ExitCode::usage, "--frames",
        "the scene has frames 0-" + std::to_string(scene.time.frames - 1) + " (set time.frames for more)");
  }
  manifest.first = frames->first;
  manifest.last = frames->second;
}

}  // namespace

void require_movie(const SceneConfig& scene) {
  if (find_program("ffmpeg") || std::max(scene.image.width, scene.image.height) <= kMostWebpPixels) return;
  throw Error(ExitCode::usage, place_of(scene, "image", "width"),
              "without ffmpeg on the PATH a movie is at most " + std::to_string(kMostWebpPixels) +
                  " pixels wide and high; install ffmpeg, or set output.movie = false");
}

namespace {

std::string opening_line(const Production& run, const Manifest& m, std::size_t particles) {
  char text[256];
  std::snprintf(text, sizeof text, "%s: %s particles, dx %g mm, frames %d-%d", run.scene().name.c_str(),
                grouped(particles).c_str(), 1e3 * grid_spacing(run.scene()), m.first, m.last);
  std::string line = text;
  if (m.pictures)
    line += " of " + std::to_string(run.scene().image.width) + "x" + std::to_string(run.scene().image.height);
  return line + ", " + std::to_string(m.threads) + " threads, " + m.isa + " -> " +
         run.folder().path().string();
}

}  // namespace

std::unique_ptr<SimulatedSnow> make_snow(const SceneConfig& scene, const kernels::KernelTable& kernels,
                                         bool force) {
  return std::make_unique<SimulatedSnow>(Simulation(kernels, build_simulation(scene, force)),
                                         scene.time.speed / scene.time.fps);
}

std::unique_ptr<Renderer> make_renderer(const SceneConfig& scene, const kernels::KernelTable& kernels) {
  const auto& formats = scene.output.formats;
  if (!has_exr() && std::find(formats.begin(), formats.end(), "exr") != formats.end()) {
    throw Error(
        ExitCode::usage, place_of(scene, "output", "formats"),
        "this firn was built without OpenEXR and cannot write \"exr\"; \"pfm\" holds the same layers");
  }
  return std::make_unique<Renderer>(kernels, build_render(scene));
}

// The kernels of x86-64-v3 and v4 give the same bits; those of `base` do not, so such a run stays with them.
std::string isa_of(const Options& options, const Manifest& manifest) {
  if (options.isa == "auto") return manifest.isa == "base" ? "base" : "auto";
  if ((options.isa == "base") != (manifest.isa == "base")) {
    throw Error(ExitCode::usage, "--isa",
                "this run was begun with " + manifest.isa +
                    ", and the kernels of base and of AVX differ in the last bits");
  }
  return options.isa;
}

void tell_of_other_build(Production& run) {
  const Manifest& m = run.manifest();
  if (m.version == version() && m.revision == revision()) return;
  run.progress().say("This run was begun by firn " + m.version + " (" + m.revision + "), and goes on with " +
                     version() + " (" + revision() + "), whose bits may differ.");
}

double expected_frame_seconds(const SceneConfig& scene, const SimulatedSnow* snow, bool pictures,
                              int threads) {
  double work = 0;
  if (snow) {
    const double steps =
        scene.time.speed / scene.time.fps / std::max(snow->simulation().stable_step().dt, 1e-9);
    work += steps * static_cast<double>(snow->simulation().particle_count()) / kParticleStepsPerSecond;
  }
  if (pictures) {
    const double paths = 1.0 * scene.image.width * scene.image.height * scene.image.samples;
    work += paths * kRaysPerPath / kRaysPerSecond;
  }
  return work / threads;
}

ExitCode run_scene(const Options& options, const RunKind& kind) {
  const auto& kernels = choose_kernels(options.isa);
  SceneConfig scene = read_scene(options.target, options.reading());
  Manifest manifest = new_manifest(options, scene, kernels.isa);
  set_frames(manifest, scene, options.frames ? options.frames : kind.frames);
  manifest.pictures = kind.pictures;
  manifest.particles = kind.particles || scene.output.particles;
  manifest.wants_movie = kind.movie && scene.output.movie;
  if (manifest.wants_movie && manifest.last > manifest.first) require_movie(scene);
  auto renderer = kind.pictures ? make_renderer(scene, kernels) : nullptr;
  RunFolder folder = RunFolder::take(scene.name, options.out, options.overwrite);
  for (const auto& [file, hash] : manifest.inputs) folder.require_outside(file);
  remove_when_interrupted(folder.made());
  auto snow = make_snow(scene, kernels, options.force);

  Production run(std::move(folder), std::move(scene), std::move(manifest), options.quiet);
  run.expected_seconds =
      expected_frame_seconds(run.scene(), snow.get(), kind.pictures, run.manifest().threads);
  run.progress().say(opening_line(run, run.manifest(), snow->simulation().particle_count()));
  run.simulated = std::move(snow);
  run.renderer = std::move(renderer);
  run.again = shell_line({"firn", "resume", as_operand(run.folder().path().string())});
  std::atomic<bool>& stop = stop_flag();
  remove_when_interrupted({});
  const ExitCode code = run.produce(frame_range(run.manifest().first, run.manifest().last), stop);
  std::cout << run.folder().path().string() << "\n";
  return code;
}

}  // namespace firn
