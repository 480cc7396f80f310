// SPDX-License-Identifier: MIT
#include "src/session/prepare.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "firn/error.h"
#include "src/core/isa.h"
#include "src/core/threads.h"
#include "src/io/exr.h"
#include "src/io/file.h"
#include "src/io/program.h"
#include "src/io/version.h"
#include "src/scene/name.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// Rates of one thread, rounded down from what settled scenes reach; see docs/ for measured ones.
constexpr double kParticleStepsPerSecond = 10e6;
constexpr double kRaysPerSecond = 4e6;
constexpr int kMostWebpPixels = 16383;
constexpr double kRaysPerPath = 3;  // most paths end at the sky early

// The files that a scene names, as they are now: absolute path and hash of the bytes. Errors: io Error for
// one that cannot be read.
std::vector<std::pair<std::string, std::string>> hash_inputs(const SceneConfig& scene) {
  std::vector<std::pair<std::string, std::string>> inputs;
  for (const std::string& file : input_files(scene)) inputs.emplace_back(file, hash_in_hex(read_file(file)));
  return inputs;
}

}  // namespace

Manifest new_manifest(const SessionOptions& options, const SceneConfig& scene, const std::string& isa) {
  Manifest m;
  m.command = options.command;
  m.version = version();
  m.revision = revision();
  m.compiler = compiler();
  m.build_type = build_type();
  m.cpu = cpu_name();
  m.isa = isa;
  m.threads = Threads::count_of(options.threads);
  m.slots = options.overlap ? kSlots : 1;
  m.force = options.force;
  m.seed = scene.simulation.seed;
  m.started = utc_now();
  m.id = hash_in_hex(std::to_string(std::chrono::system_clock::now().time_since_epoch().count()) + " " +
                     std::to_string(::getpid()));
  m.scene_file = std::filesystem::absolute(scene.file).string();
  m.scene = resolved_toml(scene);
  m.scene_hash = hash_in_hex(m.scene);
  m.inputs = hash_inputs(scene);
  m.last = scene.time.frames - 1;
  require_utf8(m.scene, scene.file);
  return m;
}

int require_threads(int threads) {
  if (threads >= 0) return threads;
  throw Error(ErrorCode::usage, "threads", "expected a number of threads, or 0 for all of the machine");
}

void require_options(const SessionOptions& options) {
  require_threads(options.threads);
  if (options.out && (options.out->empty() || options.out->find('\0') != std::string::npos))
    throw Error(ErrorCode::usage, "out", "expected the name of a folder");
}

std::size_t collider_number(const SceneConfig& scene, const std::string& name, const ColliderDriver& driver) {
  const std::vector<std::string> names = collider_names(scene);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    std::string known;
    for (const std::string& other : names) known += (known.empty() ? "" : ", ") + other;
    throw Error(
        ErrorCode::usage, "drive",
        "the scene has no collider '" + name + "'" + (known.empty() ? "; it has none" : "; it has " + known));
  }
  if (!driver) throw Error(ErrorCode::usage, "drive", "the driver of '" + name + "' is empty");
  return static_cast<std::size_t>(found - names.begin());
}

void require_utf8(const std::string& text, const std::string& where) {
  if (is_utf8(text)) return;
  throw Error(ErrorCode::usage, where,
              "a path of this run is not UTF-8, in which scenes and manifests are written: rename the folder "
              "or file");
}

void require_movie(const SceneConfig& scene) {
  if (find_program("ffmpeg") || std::max(scene.image.width, scene.image.height) <= kMostWebpPixels) return;
  throw Error(ErrorCode::usage, place_of(scene, "image", "width"),
              "without ffmpeg on the PATH a movie is at most " + std::to_string(kMostWebpPixels) +
                  " pixels wide and high; install ffmpeg, or set output.movie = false");
}

std::unique_ptr<SimulatedSnow> make_snow(const SceneConfig& scene, const kernels::KernelTable& kernels,
                                         bool force) {
  return std::make_unique<SimulatedSnow>(Solver(kernels, build_simulation(scene, force)),
                                         scene.time.speed / scene.time.fps);
}

namespace {

// What a program renders for itself needs no file that could hold it.
void require_formats(const SceneConfig& scene) {
  const auto &formats = scene.output.formats, &layers = scene.output.layers;
  const bool more = std::any_of(layers.begin(), layers.end(), [](const auto& l) { return l != "beauty"; });
  const bool linear = std::any_of(formats.begin(), formats.end(),
                                  [](const auto& format) { return format == "pfm" || format == "exr"; });
  if (more && !linear) {
    throw Error(ErrorCode::usage, place_of(scene, "output", "layers"),
                "png and ppm hold the beauty alone: add \"pfm\" or \"exr\" to formats");
  }
  if (!has_exr() && std::find(formats.begin(), formats.end(), "exr") != formats.end()) {
    throw Error(
        ErrorCode::usage, place_of(scene, "output", "formats"),
        "this firn was built without OpenEXR and cannot write \"exr\"; \"pfm\" holds the same layers");
  }
}

}  // namespace

std::unique_ptr<FrameTracer> make_tracer(const SceneConfig& scene, const kernels::KernelTable& kernels) {
  require_formats(scene);
  return std::make_unique<FrameTracer>(kernels, build_render(scene));
}

// The kernels of x86-64-v3 and v4 give the same bits; those of `base` do not, so such a run stays with them.
std::string isa_of(const SessionOptions& options, const Manifest& manifest) {
  if (options.isa == "auto") return manifest.isa == "base" ? "base" : "auto";
  if ((options.isa == "base") != (manifest.isa == "base")) {
    throw Error(ErrorCode::usage, "isa",
                "this run was begun with " + manifest.isa +
                    ", and the kernels of base and of AVX differ in the last bits");
  }
  return options.isa;
}

void tell_of_other_build(Session::State& run) {
  const Manifest& m = run.manifest();
  if (m.version == version() && m.revision == revision()) return;
  run.tell("This run was begun by firn " + m.version + " (" + m.revision + "), and goes on with " +
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

}  // namespace firn
