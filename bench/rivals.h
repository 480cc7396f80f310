// SPDX-License-Identifier: MIT
// The rivals of firn's tracer. They are compiled where Embree is found and are no part of the product.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bench/tracer.h"

namespace firn::bench {

// The balls that rivals trace.
struct Balls {
  const Snapshot& snapshot;
  std::vector<float> radius;  // m, in snapshot order
};

// Empty where firn-bench was built without Embree. `balls` must outlive them. Errors: failed.
std::vector<std::unique_ptr<Tracer>> make_rivals(const Balls& balls, const std::string& isa, int threads);

// Of Embree; empty without it.
std::string rivals_version();

}  // namespace firn::bench
