// SPDX-License-Identifier: MIT
// Runs of the firn program at their quick size, in turns: frame k+1 simulated while frame k is traced, and
// one after the other. The share of the processors is what the runs were busy of what their threads could
// have been, reading the scene and ending included.
#include "bench/overlap.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "firn/error.h"
#include "src/io/manifest.h"
#include "src/io/program.h"

namespace firn::bench {
namespace {

namespace fs = std::filesystem;

// Of unlike shares of tracing and simulating.
constexpr const char* kScenes[] = {"two_snowballs", "column_collapse", "snowball_drop"};

using Hashes = std::vector<std::pair<std::string, std::string>>;

struct Measured {
  double wall = 0, busy = 0;  // s
  Hashes hashes;              // of each frame's snow and picture
};

double busy_seconds_of_children() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("firn-overlap-" + std::to_string(::getpid()))) {}
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

Measured measure(const OverlapOptions& o, const std::string& firn, const fs::path& scene, const fs::path& out,
                 bool overlap) {
  std::vector<std::string> words = {firn,           "run",
                                    scene.string(), "--quick",
                                    "--out",        out.string(),
                                    "--overwrite",  "--quiet",
                                    "--set",        "output.movie=false",
                                    "--threads",    std::to_string(o.threads),
                                    "--isa",        o.isa};
  if (!overlap) words.push_back("--no-overlap");
  Measured measured;
  Outcome outcome;
  const double before = busy_seconds_of_children();
  measured.wall = seconds_of([&] { outcome = run_program(words); });
  measured.busy = busy_seconds_of_children() - before;
  if (!WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0)
    throw Error(ErrorCode::io, firn, "the run failed: " + outcome.said);
  for (const FrameRecord& frame : read_manifest(out / "run.json", out / "frames.jsonl").frames)
    measured.hashes.emplace_back(frame.particles_hash, frame.picture_hash);
  return measured;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

// Of one scene, the median over the repeats; the ratio is that of pairs.
Json compare(const OverlapOptions& o, const std::string& firn, const fs::path& scene, const fs::path& out) {
  std::vector<double> overlapped, sequential, ratios, shares;
  Hashes hashes;
  bool identical = true;
  for (int k = 0; k < o.repeats; ++k) {
    Measured pair[2];  // sequential, overlapped; either is first in turn
    for (const int turn : {k % 2, 1 - k % 2}) pair[turn] = measure(o, firn, scene, out, turn == 1);
    if (k == 0) hashes = pair[0].hashes;
    for (const Measured& run : pair) identical = identical && run.hashes == hashes;
    sequential.push_back(pair[0].wall);
    overlapped.push_back(pair[1].wall);
    ratios.push_back(pair[1].wall / pair[0].wall);
    shares.push_back(pair[1].busy / (pair[1].wall * o.threads));
  }
  return {{"wall_overlap_s", median(overlapped)},
          {"wall_sequential_s", median(sequential)},
          {"ratio", median(ratios)},
          {"cpu_share", median(shares)},
          {"identical", identical},
          {"frames", hashes.size()}};
}

}  // namespace

bool run_overlap(const OverlapOptions& options) {
  const std::string firn = options.firn.empty()
                               ? fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "firn"
                               : fs::path(options.firn);
  const Folder folder;
  Json scenes = Json::object();
  bool identical = true;
  std::printf("%-18s%12s%15s%8s%11s\n", "", "overlap, s", "sequential, s", "ratio", "CPU share");
  for (const std::string name : kScenes) {
    const Json row = scenes[name] =
        compare(options, firn, fs::path(options.scenes) / (name + ".toml"), folder.path());
    identical = identical && row["identical"].get<bool>();
    std::printf("%-18s%12.2f%15.2f%8.3f%10.1f%%%s\n", name.c_str(), row["wall_overlap_s"].get<double>(),
                row["wall_sequential_s"].get<double>(), row["ratio"].get<double>(),
                100 * row["cpu_share"].get<double>(),
                row["identical"].get<bool>() ? "" : "  NOT THE SAME BITS");
    std::fflush(stdout);
  }
  if (!options.json.empty()) {
    Json report = {{"benchmark", "overlap"},
                   {"threads", options.threads},
                   {"repeats", options.repeats},
                   {"scenes", scenes}};
    add_provenance(report);
    write_json(report, options.json);
  }
  return identical;
}

}  // namespace firn::bench
