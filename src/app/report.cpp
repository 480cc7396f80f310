// SPDX-License-Identifier: MIT
#include "src/app/report.h"

#include <algorithm>
#include <cstdio>

#include "src/app/progress.h"
#include "src/core/text.h"
#include "src/core/threads.h"

namespace firn {
namespace {

std::string stage_row(const char* name, const Manifest& manifest, double FrameRecord::*seconds) {
  double sum = 0, most = 0;
  for (const auto& frame : manifest.frames) {
    sum += frame.*seconds;
    most = std::max(most, frame.*seconds);
  }
  const double mean = sum / static_cast<double>(std::max<std::size_t>(manifest.frames.size(), 1));
  return text("  %-10s%10.3f%10.3f%10.1f\n", name, mean, most, sum);
}

std::string rate(const char* name, double count, double seconds, double unit, const char* unit_name) {
  if (count <= 0 || seconds <= 0) return "";
  return text("  %-18s%.2f %s\n", name, count / seconds / unit, unit_name);
}

std::string overlap(const std::vector<StageInterval>& intervals) {
  if (intervals.empty()) return "";
  double busy = 0, begin = intervals[0].begin, end = 0;
  for (const auto& i : intervals) {
    busy += i.end - i.begin;
    begin = std::min(begin, i.begin);
    end = std::max(end, i.end);
  }
  return text("  %-18s%.2f stages at work on average\n", "overlap", busy / std::max(end - begin, 1e-9));
}

}  // namespace

void print_line(const std::string& name, const std::string& value) {
  std::printf("%-18s%s\n", name.c_str(), value.c_str());
}

std::string mebibytes(double bytes) { return text("%.1f MiB", bytes / (1 << 20)); }

std::string closing_report(const RunFolder& folder, const Manifest& manifest,
                           const std::vector<StageInterval>& intervals) {
  double simulate = 0, trace = 0, steps = 0, rays = 0, samples = 0, snow = 0, medium = 0;
  for (const auto& frame : manifest.frames) {
    simulate += frame.simulate_seconds;
    trace += frame.trace_seconds;
    steps += static_cast<double>(frame.particle_steps);
    rays += static_cast<double>(frame.rays);
    snow += frame.snow_mass;
    medium += frame.medium_mass;
    samples += frame.mean_samples / static_cast<double>(manifest.frames.size());
  }
  std::string report;
  if (manifest.pictures) report += "Frames  " + folder.frames().string() + "\n";
  if (manifest.particles) report += "Snow    " + folder.particles().string() + "\n";
  if (!manifest.movie.empty()) report += "Movie   " + (folder.path() / manifest.movie).string() + "\n";
  report += "\n  s a frame       mean      most     total\n";
  report += stage_row("simulate", manifest, &FrameRecord::simulate_seconds);
  if (manifest.pictures) report += stage_row("trace", manifest, &FrameRecord::trace_seconds);
  report += stage_row("write", manifest, &FrameRecord::write_seconds);
  report += text("  %-10s%30.1f\n\n", "wall", manifest.wall_seconds);
  report += rate("particle-steps", steps, simulate, 1e6, "M/s");
  report += rate("rays", rays, trace, 1e6, "M/s");
  if (samples > 0) report += text("  %-18s%.1f\n", "samples a pixel", samples);
  if (snow > 0)
    report += text("  %-18s%.1f %% of the snow's mass; its surface clips the rest\n", "light meets",
                   100 * medium / snow);
  if (manifest.bytes_per_particle > 0) {
    report += text("  %-18s%.0f, grid included\n", "bytes a particle", manifest.bytes_per_particle);
  }
  return report + overlap(intervals) +
         text("  %-18s%d, %s", "threads", manifest.threads, manifest.isa.c_str());
}

std::string closing_report(const Session& session, const std::vector<StageInterval>& intervals, int threads) {
  const RunFolder folder = RunFolder::open(session.folder());
  Manifest manifest = read_manifest(folder.manifest(), folder.journal());
  if (session.shares()) {
    manifest.pictures = true;
    manifest.threads = Threads::count_of(threads);
  }
  return closing_report(folder, manifest, intervals);
}

void print_run(const RunFolder& folder, const Manifest& m) {
  print_line("run", folder.path().string());
  print_line("status", m.error.empty() ? m.status : m.status + ": " + m.error);
  print_line("frames", std::to_string(m.frames.size()) + " finished of " + std::to_string(m.first) + "-" +
                           std::to_string(m.last));
  print_line("scene", m.scene_file + ", seed " + std::to_string(m.seed));
  if (!m.snow_from.empty()) print_line("snow from", m.snow_from);
  print_line("command", m.command);
  print_line("started", m.started);
  print_line("version", m.version + " (" + m.revision + "), " + m.compiler + ", " + m.build_type + " build");
  print_line("cpu", m.cpu);
  std::printf("\n%s\n", closing_report(folder, m, {}).c_str());
}

}  // namespace firn
