// SPDX-License-Identifier: MIT
// What this program is and can do; or what a run is and did, whoever is at work on it.
#include <iostream>
#include <string>
#include <thread>

#include "src/app/commands.h"
#include "src/app/report.h"
#include "src/core/isa.h"
#include "src/io/exr.h"
#include "src/io/manifest.h"
#include "src/io/program.h"
#include "src/io/run_folder.h"
#include "src/io/version.h"

namespace firn {
namespace {

void print_program() {
  std::string isas;
  for (const auto* kernels : supported_kernels())
    isas += std::string(isas.empty() ? "" : ", ") + kernels->isa;
  const auto ffmpeg = find_program("ffmpeg");
  print_line("version", version() + " (" + revision() + ")");
  print_line("compiler", compiler() + ", " + build_type() + " build");
  print_line("cpu", cpu_name() + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads");
  print_line("instruction sets", isas + " (chosen: " + choose_kernels("auto").isa + ")");
  print_line("pictures", has_exr() ? "png, ppm, pfm, exr" : "png, ppm, pfm");
  print_line("movie", ffmpeg ? "mp4 through " + ffmpeg->string()
                             : std::string("animated WebP (no ffmpeg on the PATH)"));
}

}  // namespace

ExitCode info_command(const Options& options) {
  if (options.target.empty()) {
    print_program();
    return ExitCode::ok;
  }
  const RunFolder folder = RunFolder::open(options.target);
  const Manifest manifest = read_manifest(folder.manifest(), folder.journal());
  if (options.json) {
    print_manifest(std::cout, manifest);
  } else {
    print_run(folder, manifest);
  }
  return ExitCode::ok;
}

}  // namespace firn
