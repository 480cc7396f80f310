// SPDX-License-Identifier: MIT
// firn-bench: measures this machine. `firn-bench sim` times the simulation step on one fixed scene; the
// figures go to stdout for people and, with --json FILE, to a file with the machine, the instruction set and
// the compiler beside them.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "bench/sim.h"
#include "src/core/error.h"

namespace {

constexpr const char* kUsage =
    "usage: firn-bench sim [--particles N] [--threads T] [--isa I] [--steps S] [--json FILE]\n"
    "  a ball of snow (8 particles a cell, dx = 1/128 m) hits the floor at 10 m/s;\n"
    "  figures are the mean over the second half of the steps, sorting included\n";

long positive(const char* option, const char* text) {
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  if (*text == 0 || *end != 0 || value <= 0) {
    throw firn::Error(firn::ExitCode::usage, option,
                      std::string("'") + text + "' is not a positive whole number");
  }
  return value;
}

firn::bench::SimOptions parse(int argc, char** argv) {
  firn::bench::SimOptions options;
  for (int i = 2; i < argc; i += 2) {
    const std::string name = argv[i];
    if (i + 1 == argc) throw firn::Error(firn::ExitCode::usage, name, "a value is missing");
    const char* value = argv[i + 1];
    if (name == "--particles") {
      options.particles = static_cast<std::size_t>(positive("--particles", value));
    } else if (name == "--threads") {
      options.threads = static_cast<int>(positive("--threads", value));
    } else if (name == "--steps") {
      options.steps = static_cast<int>(positive("--steps", value));
    } else if (name == "--isa") {
      options.isa = value;
    } else if (name == "--json") {
      options.json = value;
    } else {
      throw firn::Error(firn::ExitCode::usage, name, "no such option");
    }
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || std::strcmp(argv[1], "sim") != 0) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  try {
    firn::bench::run_sim(parse(argc, argv));
    return 0;
  } catch (const firn::Error& error) {
    std::fprintf(stderr, "firn-bench: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}
