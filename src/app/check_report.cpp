// SPDX-License-Identifier: MIT
#include "src/app/check_report.h"

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>

#include "src/app/report.h"
#include "src/core/text.h"

namespace firn {
namespace {

constexpr int kMostOfAKind = 10;  // warnings that are printed one by one

std::string box(const Vector3& min, const Vector3& max) {
  return text("x %.4g to %.4g, y %.4g to %.4g, z %.4g to %.4g m", min[0], max[0], min[1], max[1], min[2],
              max[2]);
}

std::string range(const StepRange& steps) {
  const std::string from = grouped(steps.low);
  return steps.low == steps.high ? from : from + " to " + grouped(steps.high);
}

void print_snow(const CheckReport& report) {
  print_line("particles", grouped(report.particles) + text(", %.4g kg", report.mass));
  for (const CheckedSnow& snow : report.snow) {
    print_line("  " + snow.name,
               grouped(snow.particles) + text(", %.4g kg, %.4g m3, %.4g mg a particle", snow.mass,
                                              snow.volume, 1e6 * snow.particle_mass));
    print_line("", box(snow.bounds_min, snow.bounds_max));
  }
}

void print_time(const CheckReport& report) {
  print_line("time step",
             text("%.3g s", report.step.dt) +
                 (report.fixed_dt ? std::string(", fixed by the scene")
                                  : " at the start, limited by " + report.step.cause +
                                        text("; %.3g s where snow is packed most", report.shortest_dt)));
  print_line("frames", text("%d of %.4g s: ", report.frames, report.frame_seconds) +
                           range(report.steps_per_frame) + " steps a frame, " + range(report.steps) +
                           " in all");
}

void print_memory(const MemoryEstimate& memory) {
  const auto in_words = [](std::uint64_t bytes) { return mebibytes(static_cast<double>(bytes)); };
  print_line("memory", in_words(memory.at_start) + " at frame 0, at most " + in_words(memory.peak_low) +
                           " to " + in_words(memory.peak_high) + " later");
  print_line("", "simulation " + in_words(memory.simulation) +
                     text(" of it (%.0f bytes a particle)", memory.bytes_per_particle));
}

void print_picture(const CheckReport& report) {
  print_line("image", text("%dx%d, %d samples, %d bounces", report.width, report.height, report.samples,
                           report.max_bounces));
  std::string seen;
  const auto add = [&](const std::string& name, double fraction) {
    if (fraction > 0) seen += (seen.empty() ? "" : ", ") + name + text(" %.2g %%", 100 * fraction);
  };
  for (const CheckedSnow& snow : report.snow) add(snow.name, snow.pixel_fraction);
  for (const CheckedObject& object : report.objects) add(object.name, object.pixel_fraction);
  add("sky and lamps", report.background_fraction);
  print_line("camera sees", seen);
}

void print_warning(const std::string& place, const std::string& what) {
  std::fprintf(stderr, "%s: warning: %s\n", place.c_str(), escape_control(what).c_str());
}

// What several bodies of snow do.
const char* in_plural(WarningKind kind) {
  switch (kind) {
    case WarningKind::unseen:
      return "are not seen in frame 0";
    case WarningKind::floating:
      return "float";
    case WarningKind::sparse_points:
      return "have few points a cell";
    case WarningKind::odd_points:
      return "have points of another size than their distance";
    case WarningKind::buried:
      break;
  }
  return "lie in part under a surface";
}

}  // namespace

void print_check(const CheckReport& report, bool quick) {
  print_line("scene", report.scene + " (" + report.file + (quick ? ", quick size)" : ")"));
  print_snow(report);
  print_line("grid", text("dx %.4g m, ", report.dx) + grouped(report.grid_blocks) +
                         " blocks of 4x4x4 nodes, growing with the snow");
  print_time(report);
  if (report.blow_up) return;
  print_memory(report.memory);
  print_picture(report);
}

void print_warnings(const CheckReport& report) {
  std::map<WarningKind, std::uint64_t> counts;
  for (const SceneWarning& warning : report.warnings) {
    if (++counts[warning.kind] <= kMostOfAKind) print_warning(warning.place, warning.text);
  }
  for (const auto& [kind, count] : counts) {
    if (count > kMostOfAKind)
      print_warning(report.file, "of " + grouped(report.snow.size()) + " bodies of snow " + grouped(count) +
                                     " " + in_plural(kind));
  }
}

}  // namespace firn
