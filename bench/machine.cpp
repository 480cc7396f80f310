// SPDX-License-Identifier: MIT
#include "bench/machine.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <fstream>
#include <map>
#include <thread>

#include "src/core/aligned.h"

namespace firn::bench {

namespace isa_base {
double multiply_add(long rounds, float* sink);
double scale_in_place(float* at, std::size_t count);
}  // namespace isa_base
namespace isa_v3 {
double multiply_add(long rounds, float* sink);
double scale_in_place(float* at, std::size_t count);
}  // namespace isa_v3
namespace isa_v4 {
double multiply_add(long rounds, float* sink);
double scale_in_place(float* at, std::size_t count);
}  // namespace isa_v4

namespace {

struct Loops {
  double (*multiply_add)(long rounds, float* sink);
  double (*scale_in_place)(float* at, std::size_t count);
};

Loops loops_of(const std::string& isa) {
  if (isa == "x86-64-v4") return {isa_v4::multiply_add, isa_v4::scale_in_place};
  if (isa == "x86-64-v3") return {isa_v3::multiply_add, isa_v3::scale_in_place};
  return {isa_base::multiply_add, isa_base::scale_in_place};
}

// The largest amount a second of several calls of work(), which returns the amount done.
template <class Work>
double best_rate(int repeats, Work&& work) {
  double best = 0;
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const double done = work();
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    best = std::max(best, done / seconds.count());
  }
  return best;
}

// The first "key : value" lines of /proc/cpuinfo.
std::map<std::string, std::string> cpu_lines() {
  std::map<std::string, std::string> lines;
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line) && !line.empty();) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::string key = line.substr(0, line.find_last_not_of(" \t", colon - 1) + 1);
    lines[key] = colon + 2 <= line.size() ? line.substr(colon + 2) : "";
  }
  return lines;
}

}  // namespace

Machine this_machine() {
  auto lines = cpu_lines();
  const std::string family = lines["cpu family"], model = lines["model"];
  Machine machine;
  machine.cpu = lines["model name"] + " (family " + family + ", model " + model + ")";
  machine.slug = lines["vendor_id"] + "-" + family + "-" + model;
  for (char& c : machine.slug) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  machine.cores = std::thread::hardware_concurrency();
  return machine;
}

Limits measure_limits(const std::string& isa) {
  constexpr long kRounds = 2000000;
  constexpr std::size_t kFloats = std::size_t{1} << 26;  // 256 MiB
  const Loops loops = loops_of(isa);
  AlignedArray<float> array;
  array.reserve_discarding(kFloats);
  std::fill(array.data(), array.data() + kFloats, 1.f);
  return {best_rate(20, [&] { return loops.multiply_add(kRounds, array.data()); }),
          best_rate(8, [&] { return loops.scale_in_place(array.data(), kFloats); })};
}

}  // namespace firn::bench
