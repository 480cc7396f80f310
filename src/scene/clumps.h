// SPDX-License-Identifier: MIT
// Real snow is uneven: it breaks along seams between denser lumps. Even snow smears when it is torn, because
// no place in it is weaker than the next. Clumps give the start such seams: cells around scattered points
// (Worley 1996, "A cellular texture basis function"), loosened along their borders.
#pragma once
#include <cstdint>
#include <vector>

#include "src/core/vector.h"

namespace firn {

// The plastic volume ratio Jp of each particle at the start: 1 inside a clump, up to 1 + looseness on the
// border of two. `size` (m) is the mean distance of clumps. A particle's value depends on its place and `key`
// alone.
std::vector<float> clump_packing(const std::vector<Vec3>& positions, double looseness, double size,
                                 std::uint64_t key);

}  // namespace firn
