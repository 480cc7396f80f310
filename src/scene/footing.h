// SPDX-License-Identifier: MIT
// What snow stands on when a run begins: for the warnings of `firn check`.
#pragma once
#include <limits>
#include <vector>

#include "src/mpm/solver.h"

namespace firn {

struct Footing {
  // m, from its particles' centres to the nearest collider, of this body and of all that it touches by way of
  // one another; infinite where there is no collider.
  double clearance = std::numeric_limits<double>::infinity();
  double buried = 0;      // the part of its particles that lies deeper than a cell inside one of the solids
  std::size_t solid = 0;  // in which most of them lie
};

// One entry a body of snow. `solids`: all that is felt or seen, where it is at the start.
std::vector<Footing> footing_of(const SolverSetup& setup, const std::vector<Shape>& solids);

}  // namespace firn
