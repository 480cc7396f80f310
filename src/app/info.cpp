// SPDX-License-Identifier: MIT
#include <cstdio>
#include <string>
#include <thread>

#include "src/app/commands.h"
#include "src/core/isa.h"
#include "src/io/program.h"
#include "src/io/version.h"

namespace firn {

ExitCode info_command(const Options&) {
  std::string isas;
  for (const auto* kernels : supported_kernels())
    isas += std::string(isas.empty() ? "" : ", ") + kernels->isa;
  const auto ffmpeg = find_program("ffmpeg");
  const auto line = [](const char* name, const std::string& value) {
    std::printf("%-18s%s\n", name, value.c_str());
  };
  line("version", version() + " (" + revision() + ")");
  line("compiler", compiler() + ", " + build_type() + " build");
  line("cpu", cpu_name() + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads");
  line("instruction sets", isas + " (chosen: " + choose_kernels("auto").isa + ")");
  line("pictures", "png, ppm, pfm");
  line("movie",
       ffmpeg ? "mp4 through " + ffmpeg->string() : std::string("animated WebP (no ffmpeg on the PATH)"));
  return ExitCode::ok;
}

}  // namespace firn
