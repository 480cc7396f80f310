// SPDX-License-Identifier: MIT
// firn-bench trace: how fast balls that moved since the last frame are traced, by firn and by its rivals. A
// frame rebuilds everything. The tracers take turns, frame by frame, so that all see the machine in the same
// mood; each figure is the best of its repeats.
#include "bench/trace.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "bench/report.h"
#include "bench/rivals.h"
#include "bench/stopwatch.h"
#include "bench/trace_frame.h"
#include "bench/trace_scene.h"
#include "bench/tracer_firn.h"
#include "firn/error.h"
#include "src/core/isa.h"

namespace firn::bench {

namespace {

constexpr int kTrials = 3;                 // frames of each way in which a rival can trace
constexpr double kAgreement = 1e-4;        // relative, of what the camera sees
constexpr double kSecondAgreement = 1e-3;  // of what is seen from there: a ray may start inside a neighbour
constexpr const char* kKindNames[kRayKindCount] = {"primary", "shadow", "diffuse"};

struct Bests {
  Best build, interactive, frame, shading, rays[kRayKindCount];
  FrameTally last;

  void add(const FrameTally& tally) {
    build.add(tally.build);
    interactive.add(tally.interactive);
    frame.add(tally.frame);
    shading.add(tally.shading);
    for (std::size_t kind = 0; kind < kRayKindCount; ++kind) rays[kind].add(tally.rays[kind].seconds);
    last = tally;
  }
};

struct Contender {
  Tracer* tracer;
  Bests bests;
  std::string way[kRayKindCount];
};

// Finds the fastest way for each kind of rays.
void choose_ways(TraceFrame& frame, Contender& contender) {
  const std::vector<std::string> ways = contender.tracer->ways();
  std::vector<Bests> trials(ways.size());
  for (int trial = 0; trial < kTrials; ++trial) {
    for (std::size_t way = 0; way < ways.size(); ++way) {
      for (const RayKind kind : kRayKinds) contender.tracer->choose(kind, way);
      trials[way].add(frame.render(*contender.tracer));
    }
  }
  for (std::size_t kind = 0; kind < kRayKindCount && !ways.empty(); ++kind) {
    const auto fastest = std::min_element(trials.begin(), trials.end(), [&](const Bests& a, const Bests& b) {
      return a.rays[kind].seconds() < b.rays[kind].seconds();
    });
    const auto way = static_cast<std::size_t>(fastest - trials.begin());
    contender.tracer->choose(kRayKinds[kind], way);
    contender.way[kind] = ways[way];
  }
}

Json figures(const Contender& c, std::size_t particles) {
  const Bests& b = c.bests;
  Json json = {{"build_ms", 1e3 * b.build.seconds()}};
  for (std::size_t kind = 0; kind < kRayKindCount; ++kind) {
    json[std::string(kKindNames[kind]) + "_mrays"] =
        1e-6 * static_cast<double>(b.last.rays[kind].rays) / b.rays[kind].seconds();
  }
  json["frame_ms"] = 1e3 * b.frame.seconds();
  json["interactive_ms"] = 1e3 * b.interactive.seconds();
  json["shading_ms"] = 1e3 * b.shading.seconds();
  json["bytes_per_particle"] = static_cast<double>(c.tracer->bytes()) / static_cast<double>(particles);
  for (std::size_t kind = 0; kind < kRayKindCount; ++kind) {
    const RayTally& rays = b.last.rays[kind];
    Json found = {{"rays", rays.rays}, {"hits", rays.hits}};
    if (kRayKinds[kind] != RayKind::shadow) found["mean_t"] = rays.mean_t;
    if (!c.way[kind].empty()) found["way"] = c.way[kind];
    json[kKindNames[kind]] = found;
  }
  return json;
}

// How many times better firn is than each of its rivals.
Json ratios_of(const Json& all) {
  Json ratios = Json::object();
  const Json& firn = all["firn"];
  for (const auto& [name, rival] : all.items()) {
    if (name == "firn") continue;
    for (const char* key : {"primary_mrays", "shadow_mrays", "diffuse_mrays"}) {
      ratios[std::string(key) + ", firn / " + name] = firn[key].get<double>() / rival[key].get<double>();
    }
    for (const char* key : {"build_ms", "frame_ms", "interactive_ms"}) {
      ratios[std::string(key) + ", " + name + " / firn"] = rival[key].get<double>() / firn[key].get<double>();
    }
  }
  return ratios;
}

bool near(double a, double b, double tolerance) { return std::fabs(a - b) <= tolerance * std::fabs(a); }

// Warns of each difference.
bool agree(const Contender& a, const Contender& b) {
  bool same = true;
  for (std::size_t kind = 0; kind < kRayKindCount; ++kind) {
    const double tolerance = kRayKinds[kind] == RayKind::primary ? kAgreement : kSecondAgreement;
    const RayTally &mine = a.bests.last.rays[kind], &other = b.bests.last.rays[kind];
    if (near(static_cast<double>(mine.hits), static_cast<double>(other.hits), tolerance) &&
        near(mine.mean_t, other.mean_t, tolerance)) {
      continue;
    }
    same = false;
    std::fprintf(stderr, "warning: of %zu and %zu %s rays, %s hits %zu at %.6g m, %s %zu at %.6g m\n",
                 mine.rays, other.rays, kKindNames[kind], a.tracer->name(), mine.hits, mine.mean_t,
                 b.tracer->name(), other.hits, other.mean_t);
  }
  return same;
}

void print(const Json& r) {
  std::printf("%s: %.0f particles of radius %g in the order of %s, %d threads, %s, %s, %s clock\n",
              r["shape"].get<std::string>().c_str(), r["particles"].get<double>(), r["radius"].get<double>(),
              r["order"].get<std::string>().c_str(), r["threads"].get<int>(),
              r["isa"].get<std::string>().c_str(), r["machine"]["cpu"].get<std::string>().c_str(),
              r["clock"].get<std::string>().c_str());
  std::printf("%-21s %8s %8s %8s %8s %8s %11s %9s %9s   M rays/s, ms, bytes a particle\n", "", "build",
              "primary", "shadow", "diffuse", "frame", "interactive", "shading", "bytes");
  for (const auto& [name, f] : r["tracers"].items()) {
    const auto number = [&f = f](const char* key) { return f[key].get<double>(); };
    std::printf("%-21s %8.1f %8.1f %8.1f %8.1f %8.1f %11.1f %9.1f %9.1f\n", name.c_str(), number("build_ms"),
                number("primary_mrays"), number("shadow_mrays"), number("diffuse_mrays"), number("frame_ms"),
                number("interactive_ms"), number("shading_ms"), number("bytes_per_particle"));
  }
  for (const auto& [name, f] : r["tracers"].items()) {
    std::printf("%s:", name.c_str());
    for (const char* kind : kKindNames) {
      std::printf(" %s %zu of %zu hit%s", kind, f[kind]["hits"].get<std::size_t>(),
                  f[kind]["rays"].get<std::size_t>(),
                  f[kind].contains("way") ? (" (" + f[kind]["way"].get<std::string>() + ")").c_str() : "");
    }
    std::printf("; mean distance %.6g m\n", f["primary"]["mean_t"].get<double>());
  }
  if (rivals_version().empty()) {
    std::printf("built without Embree, so without rivals: apt install libembree-dev, then build anew\n");
  }
  for (const auto& [name, ratio] : r["ratios"].items())
    std::printf("%6.2f  %s\n", ratio.get<double>(), name.c_str());
}

int busy_threads(const TraceOptions& options) {
  if (options.clock != "wall" && options.clock != "cpu") {
    throw Error(ErrorCode::usage, "--clock", "'" + options.clock + "' is neither wall nor cpu");
  }
  return options.clock == "cpu" ? options.threads : 0;
}

}  // namespace

bool run_trace(const TraceOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  const TraceScene scene = trace_scene(options.shape, options.order, options.particles);
  FirnTracer firn(scene.snapshot, options.radius, kernels);
  firn.build();
  const Balls balls{scene.snapshot, firn.radii()};
  std::vector<std::unique_ptr<Tracer>> rivals;
  if (options.rivals) rivals = make_rivals(balls, kernels.isa, options.threads);
  std::vector<Contender> contenders(1);
  contenders[0].tracer = &firn;
  for (const auto& rival : rivals) contenders.emplace_back().tracer = rival.get();

  TraceFrame frame(scene, busy_threads(options));
  for (Contender& c : contenders) choose_ways(frame, c);
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (Contender& c : contenders) c.bests.add(frame.render(*c.tracer));
  }

  bool same = true;
  Json all = Json::object();
  for (const Contender& c : contenders) {
    all[c.tracer->name()] = figures(c, scene.snapshot.size());
    same &= agree(contenders[0], c);
  }
  Json report = {{"tracers", all},
                 {"ratios", rivals.empty() ? Json::object() : ratios_of(all)},
                 {"shape", options.shape},
                 {"radius", options.radius},
                 {"particles", scene.snapshot.size()},
                 {"order", options.order},
                 {"threads", options.threads},
                 {"isa", kernels.isa},
                 {"clock", options.clock},
                 {"embree", rivals.empty() ? Json() : Json(rivals_version())}};
  add_provenance(report);
  print(report);
  if (!options.json.empty()) write_json(report, options.json);
  return same;
}

}  // namespace firn::bench
