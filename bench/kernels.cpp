// SPDX-License-Identifier: MIT
// firn-bench kernels: one entry a kernel. The ball of the impact scene is stepped until a good part of it
// yields; from there the step goes on with a clock around each kernel's loop over all blocks, so that every
// kernel sees real particles, really out of order, and memory as cold as in a step. The best pass counts.
#include "bench/kernels.h"

#include <tbb/global_control.h>

#include <cstdio>
#include <cstring>

#include "bench/counts.h"
#include "bench/machine.h"
#include "bench/report.h"
#include "bench/scene.h"
#include "bench/stopwatch.h"
#include "bench/svd.h"
#include "src/core/isa.h"
#include "src/mpm/state.h"

namespace firn::bench {

namespace {

constexpr double kUntil = 6e-3;  // s, of the impact
constexpr int kPasses = 20;
constexpr int kSortPasses = 5;
constexpr std::size_t kSvdMatrices = 16384;  // they stay in the caches

struct Entry {
  const char* name;
  const char* per;  // "particle", "node" or "matrix"
  double ns;        // a unit
  double flops, bytes;
};

using State = Solver::State;

kernels::ParticleRange range_of_block(const State& s, std::size_t b) {
  return {s.blocks.begin[b], s.blocks.begin[b + 1]};
}

void advance_to_impact(State& s) {
  while (s.time < kUntil) s.step(std::min(1e-4, 0.9 * stable_limit(s).dt));
}

struct TransferTimes {
  Best p2g, reduce, grid, g2p, sort;
};

// One step, kernel by kernel, as step.cpp makes it.
void timed_step(State& s, TransferTimes& times) {
  const kernels::StepParams params = s.step_params(0.9 * stable_limit(s).dt);
  if (s.summary.strayed) s.sort();
  times.p2g.add(seconds_of([&] { s.particles_to_grid(params); }));
  times.reduce.add(seconds_of([&] {
    for (std::size_t g = 0; g < s.grid.size(); ++g) {
      const float* tiles[kernels::kNeighbours];
      s.grid.tiles_around(
          g, [](std::size_t) { return true; }, tiles);
      s.kernels.mpm.reduce_tiles(tiles, s.grid.nodes(g));
    }
  }));
  std::vector<double> impulses(kernels::kImpulseParts * s.setup.colliders.size());
  times.grid.add(seconds_of([&] {
    for (std::size_t g = 0; g < s.grid.size(); ++g) {
      const auto& contacts = s.grid.contacts(g);
      s.kernels.mpm.grid_update(params, contacts.data(), static_cast<int>(contacts.size()), ~std::uint64_t{0},
                                s.grid.nodes(g), impulses.data());
    }
  }));
  times.g2p.add(seconds_of([&] { s.grid_to_particles(params); }));
}

void add_transfers(State& s, std::vector<Entry>& out) {
  TransferTimes times;
  double clamped = 0;
  for (int i = 0; i < kPasses; ++i) {
    timed_step(s, times);
    clamped += s.summary.clamped;
  }
  for (int i = 0; i < kSortPasses; ++i) {
    timed_step(s, times);
    times.sort.add(seconds_of([&] { s.sort(); }));
  }
  const double n = static_cast<double>(s.particles.size());
  clamped /= n * kPasses;
  const double nodes = 64.0 * static_cast<double>(s.grid.size());
  const double tile_bytes = 4.0 * kernels::kTileFloats * static_cast<double>(s.blocks.size());
  const auto ns = [](const Best& best, double units) { return best.seconds() * 1e9 / units; };
  out.push_back({"P2G", "particle", ns(times.p2g, n), kWeightFlops + kStressFlops + kScatterFlops,
                 kP2gBytes + tile_bytes / n});
  out.push_back(
      {"tile reduction", "particle", ns(times.reduce, n), tile_bytes / 4 / n, (tile_bytes + 16 * nodes) / n});
  out.push_back({"grid update", "node", ns(times.grid, nodes), kGridNodeFlops, kGridNodeBytes});
  out.push_back({"G2P", "particle", ns(times.g2p, n),
                 kGatherWeightFlops + kGatherFlops + kAdvanceFlops + kYieldFlops + clamped * kClampFlops,
                 kG2pBytes + 16 * nodes / n});
  out.push_back({"sort", "particle", ns(times.sort, n), 0, kSortBytes});
}

void add_stress(const State& s, std::vector<Entry>& out) {
  const std::size_t n = s.particles.size(), stride = (n + 15) / 16 * 16 + 16;
  std::vector<float> tau(6 * stride);
  Best best;
  for (int i = 0; i < kPasses; ++i) {
    best.add(seconds_of([&] {
      s.kernels.mpm.stress(s.materials.data(), s.particles.view(), {0, n}, tau.data(), stride);
    }));
  }
  out.push_back(
      {"stress", "particle", best.seconds() * 1e9 / static_cast<double>(n), kStressFlops, kStressBytes});
}

// F as the next step would bring it to the yield surface, and Jp.
std::vector<float> trial_columns(const State& s, float dt) {
  const kernels::ParticleView p = s.particles.view();
  const std::size_t n = s.particles.size();
  std::vector<float> columns(10 * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 9; ++k) {
      const std::size_t r = k / 3, c = k % 3;
      float f = p.F[k][i];
      for (std::size_t j = 0; j < 3; ++j) f += dt * p.C[3 * r + j][i] * p.F[3 * j + c][i];
      columns[k * n + i] = f;
    }
    columns[9 * n + i] = p.Jp[i];
  }
  return columns;
}

void restore(const std::vector<float>& columns, const State& s) {
  const kernels::ParticleView p = s.particles.view();
  const std::size_t n = s.particles.size();
  for (std::size_t k = 0; k < 9; ++k) std::memcpy(p.F[k], columns.data() + k * n, 4 * n);
  std::memcpy(p.Jp, columns.data() + 9 * n, 4 * n);
}

// Leaves the trial F in the state.
void add_plasticity(State& s, std::vector<Entry>& out) {
  const std::size_t n = s.particles.size();
  const std::vector<float> trial = trial_columns(s, static_cast<float>(0.9 * stable_limit(s).dt));
  Best best;
  int clamped = 0;
  for (int i = 0; i < kPasses / 2; ++i) {
    restore(trial, s);
    best.add(seconds_of([&] {
      clamped = 0;
      for (std::size_t b = 0; b < s.blocks.size(); ++b) {
        clamped += s.kernels.mpm.project(s.materials.data(), s.particles.view(), range_of_block(s, b));
      }
    }));
  }
  restore(trial, s);
  const double count = static_cast<double>(n);
  out.push_back({"plasticity", "particle", best.seconds() * 1e9 / count,
                 kYieldFlops + kClampFlops * clamped / count, kYieldBytes});
}

Matrices matrices_of(const State& s) {
  const kernels::ParticleView p = s.particles.view();
  const std::size_t count = std::min(kSvdMatrices, s.particles.size());
  Matrices out;
  for (std::size_t k = 0; k < 9; ++k) out.entry[k].assign(p.F[k], p.F[k] + count);
  return out;
}

struct Comparison {
  double firn, eigen;  // ns a matrix
};
Comparison compare_svd(const kernels::KernelTable& kernels, const Matrices& matrices) {
  return {time_svd(kernels, matrices), time_eigen_svd(matrices)};
}

Json entry_json(const Entry& e, const Limits& limits) {
  const double floor = std::max(e.flops / limits.flops, e.bytes / limits.bytes);
  return {{"kernel", e.name},
          {"per", e.per},
          {"ns", e.ns},
          {"flops", e.flops},
          {"bytes", e.bytes},
          {"gflops", e.flops / e.ns},
          {"gbytes", e.bytes / e.ns},
          {"floor_ns", 1e9 * floor},
          {"floor_share", 1e9 * floor / e.ns},
          {"bound", e.flops / limits.flops > e.bytes / limits.bytes ? "flops" : "bytes"}};
}

void print(const Json& r) {
  std::printf("%zu particles, 1 thread, %s, %s, %.1f %% clamped\n", r["particles"].get<std::size_t>(),
              r["isa"].get<std::string>().c_str(), r["machine"]["cpu"].get<std::string>().c_str(),
              100 * r["clamped_share"].get<double>());
  std::printf("FMA peak %.0f GF/s, memory %.0f GB/s\n", 1e-9 * r["fma_peak"].get<double>(),
              1e-9 * r["memory_bandwidth"].get<double>());
  for (const Json& e : r["kernels"]) {
    std::printf("%-15s %7.2f ns a %-8s %6.1f GF/s %6.1f GB/s %5.1f %% of the floor (%s)\n",
                e["kernel"].get<std::string>().c_str(), e["ns"].get<double>(),
                e["per"].get<std::string>().c_str(), e["gflops"].get<double>(), e["gbytes"].get<double>(),
                100 * e["floor_share"].get<double>(), e["bound"].get<std::string>().c_str());
  }
  for (const char* of : {"random", "snow"}) {
    const Json& s = r["svd"][of];
    std::printf("SVD of %s matrices: %.1f ns, Eigen::JacobiSVD %.1f ns, %.1f times\n", of,
                s["ns"].get<double>(), s["eigen_ns"].get<double>(), s["ratio_to_eigen"].get<double>());
  }
}

Json svd_json(const Comparison& c) {
  return {{"ns", c.firn}, {"eigen_ns", c.eigen}, {"ratio_to_eigen", c.eigen / c.firn}};
}

}  // namespace

void run_kernels(const KernelOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  State state(kernels, bench_scene("impact", options.particles));
  place_particles(state);
  state.rebuild_grid();
  state.summarise();
  advance_to_impact(state);

  std::vector<Entry> entries;
  add_transfers(state, entries);
  const double clamped_share = state.summary.clamped / static_cast<double>(state.particles.size());
  add_stress(state, entries);
  add_plasticity(state, entries);
  const Comparison random = compare_svd(kernels, random_matrices(kSvdMatrices));
  const Comparison snow = compare_svd(kernels, matrices_of(state));
  entries.push_back({"SVD", "matrix", random.firn, kSvdFlops, kSvdBytes});

  const Limits limits = measure_limits(kernels.isa);
  Json report = {{"isa", kernels.isa},
                 {"threads", 1},
                 {"particles", state.particles.size()},
                 {"clamped_share", clamped_share},
                 {"fma_peak", limits.flops},
                 {"memory_bandwidth", limits.bytes},
                 {"kernels", Json::array()},
                 {"svd", {{"random", svd_json(random)}, {"snow", svd_json(snow)}}}};
  for (const Entry& e : entries) report["kernels"].push_back(entry_json(e, limits));
  add_provenance(report);
  print(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
