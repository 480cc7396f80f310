// SPDX-License-Identifier: MIT
// A saved simulation, as it lies inside a checkpoint: once as it is, once with the head and the fingerprint
// of the scene put right. The laws: what was loaded is saved and loaded again to the same
// bytes, and it can be shown and measured.
#include <tbb/global_control.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>

#include "firn/error.h"
#include "tests/fuzz/readers.h"
#include "tests/fuzz/tiny_snow.h"

namespace firn::fuzz {
namespace {

constexpr std::size_t kHead = 16;  // bytes: magic word and fingerprint

std::string saved(const Solver& snow) {
  std::ostringstream out;
  snow.save(out);
  return out.str();
}

bool loads(Solver& snow, const std::string& bytes) {
  try {
    std::istringstream in(bytes);
    snow.load(in);
  } catch (const Error&) {
    return false;
  }
  return true;
}

}  // namespace

void state(std::string_view input) {
  static const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  static std::optional<Solver> snow = tiny_snow();
  static const std::string good = saved(*snow);
  const std::string right_head =
      good.substr(0, kHead) + std::string(input.substr(std::min(kHead, input.size())));
  for (const std::string& bytes : {std::string(input), right_head}) {
    if (!loads(*snow, bytes)) continue;
    const std::string first = saved(*snow);
    require(loads(*snow, first), "a state that was saved can be loaded");
    require(saved(*snow) == first, "a state that was saved and loaded is saved as the same bytes");
    Snapshot snapshot;
    snow->snapshot(snapshot);
    snow->metrics();
    // With fewer particles than it had, it takes no state that has all.
    if (!loads(*snow, good)) snow.emplace(tiny_snow());
  }
}

}  // namespace firn::fuzz
