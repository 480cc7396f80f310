// SPDX-License-Identifier: MIT
// Percentiles by mass: the value below which lies a given part of the snow's mass. One pass over the upper
// half of the values' bits and one over the lower half, each a sum of mass per bit pattern in the order of
// the particles: exact, linear in their number, and the same on any number of threads.
#pragma once
#include <vector>

namespace firn {

// `part` in [0, 1]; mass[i] > 0 (kg) belongs to value[i]. 0 where there is nothing.
float mass_percentile(const std::vector<float>& value, const float* mass, double part);

}  // namespace firn
