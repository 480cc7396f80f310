// SPDX-License-Identifier: MIT
// firn-bench: measures this machine. The figures go to stdout for people and, with --json FILE, to a file
// with the machine, the instruction set and the compiler beside them.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <type_traits>

#include "bench/kernels.h"
#include "bench/medium.h"
#include "bench/mesh.h"
#include "bench/overlap.h"
#include "bench/preview.h"
#include "bench/resting.h"
#include "bench/rule.h"
#include "bench/sim.h"
#include "bench/sphere.h"
#include "bench/trace.h"
#include "firn/error.h"

namespace {

constexpr const char* kUsage =
    "usage: firn-bench sim [--scene impact|falling|settled] [--particles N] [--threads T] [--isa I]\n"
    "                      [--steps S] [--dt D] [--no-naive] [--naive-svd five-sweeps|converged] [--json "
    "FILE]\n"
    "  a ball of snow (8 particles a cell, dx = 1/128 m) thrown at a floor with 10 m/s, or falling, or a\n"
    "  packed block lying on the floor; means over the second half of the steps, sorting and all else\n"
    "  included; dt is fixed, D or as often halved as it takes to be stable; the baseline's SVD does five\n"
    "  sweeps for every matrix, or as many as each needs\n"
    "usage: firn-bench kernels [--particles N] [--isa I] [--json FILE]\n"
    "  each kernel by itself on one thread, on snow in the middle of the impact\n"
    "usage: firn-bench resting [--particles N] [--threads T] [--isa I] [--steps S] [--dt D] [--json FILE]\n"
    "  a packed bed at rest and, beside it, the impact of a ball of a tenth of the particles: what a step\n"
    "  costs with sleep and without\n"
    "usage: firn-bench trace [--particles N] [--shape ball|slab] [--radius r] [--threads T]\n"
    "                        [--order blocks|lattice] [--isa I] [--repeats R]\n"
    "                        [--clock wall|cpu] [--no-rivals] [--json FILE]\n"
    "  a frame of 1024 x 768 pixels of balls of radius r lattice spacings: rebuild, camera rays, a shadow "
    "ray\n"
    "  from each hit that faces the light, a bounce ray from each hit; firn's tracer and, where firn-bench "
    "was\n"
    "  built with Embree, two ways to do it with Embree; the best of R frames each, taken in turns; a frame\n"
    "  is rebuild and rays, an interactive one that without bounce rays, and shading what lies between;\n"
    "  the cpu clock counts what the processors are busy, divided by the threads: for a machine that is "
    "shared\n"
    "usage: firn-bench medium [--particles N] [--isa I] [--json FILE]\n"
    "  flights of light through a ball of snow from collision to collision, on one thread\n"
    "usage: firn-bench rule [--particles N] [--shape ball|slab] [--radius r] [--isa I] [--repeats R]\n"
    "                       [--json FILE]\n"
    "  rays by packets, together and one by one, from pixels of a sixteenth of a spacing to such of eight, "
    "on\n"
    "  one thread; and what the renderer's rule loses against the best\n"
    "usage: firn-bench mesh [--triangles N] [--isa I] [--repeats R] [--json FILE]\n"
    "  rays against a bumpy ball of triangles, on one thread\n"
    "usage: firn-bench preview [--particles N] [--shape ball|slab] [--threads T] [--isa I] [--repeats R]\n"
    "                          [--clock wall|cpu] [--json FILE]\n"
    "  a frame of the preview, 960 x 540 pixels, and each of its stages; the best of R frames\n"
    "usage: firn-bench sphere [--integrator bidirectional|path] [--samples S] [--threads T] [--isa I]\n"
    "                         [--repeats R] [--json FILE]\n"
    "  paths of light through a homogeneous sphere, 128 x 128 pixels; the best of R pictures\n"
    "usage: firn-bench overlap [--firn PROGRAM] [--scenes FOLDER] [--threads T] [--isa I] [--repeats R]\n"
    "                          [--json FILE]\n"
    "  whole runs of three scenes with overlapping frames and without, in turns; medians\n";

double positive(const std::string& option, const char* text) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (*text == 0 || *end != 0 || !(value > 0)) {
    throw firn::Error(firn::ErrorCode::usage, option, std::string("'") + text + "' is not a positive number");
  }
  return value;
}

// What each option does; `takes` has those that are followed by a value.
struct Options {
  std::map<std::string, std::function<void(const char* value)>> takes;
  std::map<std::string, std::function<void()>> flags;

  void read(int argc, char** argv) const {
    for (int i = 2; i < argc; ++i) {
      const std::string name = argv[i];
      if (const auto flag = flags.find(name); flag != flags.end()) {
        flag->second();
        continue;
      }
      const auto option = takes.find(name);
      if (option == takes.end()) throw firn::Error(firn::ErrorCode::usage, name, "no such option");
      if (++i == argc) throw firn::Error(firn::ErrorCode::usage, name, "a value is missing");
      option->second(argv[i]);
    }
  }
};

auto number(const char* name, auto& out) {
  return [name, &out](const char* text) {
    out = static_cast<std::remove_reference_t<decltype(out)>>(positive(name, text));
  };
}

auto word(std::string& out) {
  return [&out](const char* text) { out = text; };
}

bool stops_early(const std::string& naive_svd) {
  if (naive_svd != "five-sweeps" && naive_svd != "converged") {
    throw firn::Error(firn::ErrorCode::usage, "--naive-svd",
                      "'" + naive_svd + "' is neither five-sweeps nor converged");
  }
  return naive_svd == "converged";
}

bool asks_for_help(int argc, char** argv) {
  return std::any_of(argv + 1, argv + argc,
                     [](const std::string& word) { return word == "--help" || word == "-h"; });
}

// An option for each member that a benchmark's options have, named as the member is.
template <class Of>
Options options_of(Of& o) {
  Options options;
  auto& takes = options.takes;
  if constexpr (requires { o.particles; }) takes["--particles"] = number("--particles", o.particles);
  if constexpr (requires { o.triangles; }) takes["--triangles"] = number("--triangles", o.triangles);
  if constexpr (requires { o.radius; }) takes["--radius"] = number("--radius", o.radius);
  if constexpr (requires { o.threads; }) takes["--threads"] = number("--threads", o.threads);
  if constexpr (requires { o.repeats; }) takes["--repeats"] = number("--repeats", o.repeats);
  if constexpr (requires { o.samples; }) takes["--samples"] = number("--samples", o.samples);
  if constexpr (requires { o.steps; }) takes["--steps"] = number("--steps", o.steps);
  if constexpr (requires { o.dt; }) takes["--dt"] = number("--dt", o.dt);
  if constexpr (requires { o.firn; }) takes["--firn"] = word(o.firn);
  if constexpr (requires { o.scenes; }) takes["--scenes"] = word(o.scenes);
  if constexpr (requires { o.scene; }) takes["--scene"] = word(o.scene);
  if constexpr (requires { o.shape; }) takes["--shape"] = word(o.shape);
  if constexpr (requires { o.order; }) takes["--order"] = word(o.order);
  if constexpr (requires { o.clock; }) takes["--clock"] = word(o.clock);
  if constexpr (requires { o.integrator; }) takes["--integrator"] = word(o.integrator);
  if constexpr (requires { o.stop_early; })
    takes["--naive-svd"] = [&o](const char* text) { o.stop_early = stops_early(text); };
  if constexpr (requires { o.naive; }) options.flags["--no-naive"] = [&o] { o.naive = false; };
  if constexpr (requires { o.rivals; }) options.flags["--no-rivals"] = [&o] { o.rivals = false; };
  takes["--isa"] = word(o.isa);
  takes["--json"] = word(o.json);
  return options;
}

// False if the benchmark found its contenders to disagree.
template <class Of, auto kRun>
bool run(int argc, char** argv) {
  Of o;
  options_of(o).read(argc, argv);
  if constexpr (std::is_void_v<decltype(kRun(o))>) {
    kRun(o);
    return true;
  } else {
    return kRun(o);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (asks_for_help(argc, argv)) {
    std::fputs(kUsage, stdout);
    return 0;
  }
  namespace bench = firn::bench;
  const std::map<std::string, bool (*)(int, char**)> commands = {
      {"sim", run<bench::SimOptions, bench::run_sim>},
      {"kernels", run<bench::KernelOptions, bench::run_kernels>},
      {"resting", run<bench::RestingOptions, bench::run_resting>},
      {"trace", run<bench::TraceOptions, bench::run_trace>},
      {"medium", run<bench::MediumOptions, bench::run_medium>},
      {"preview", run<bench::PreviewOptions, bench::run_preview>},
      {"sphere", run<bench::SphereOptions, bench::run_sphere>},
      {"mesh", run<bench::MeshOptions, bench::run_mesh>},
      {"rule", run<bench::RuleOptions, bench::run_rule>},
      {"overlap", run<bench::OverlapOptions, bench::run_overlap>}};
  const auto command = commands.find(argc < 2 ? "" : argv[1]);
  if (command == commands.end()) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  try {
    return command->second(argc, argv) ? 0 : 1;
  } catch (const firn::Error& error) {
    std::fprintf(stderr, "firn-bench: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}
