// SPDX-License-Identifier: MIT
// Which balls overlap each cell of a brick, gathered from the balls' own cells around it.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/trace/table.h"

namespace firn {

struct CellLists {
  std::vector<std::uint32_t> ball[kernels::kCellsPerBrick];  // sorted indices, by increasing cell and index
};

// Adds to `lists`; `margin` (m) is added to every radius.
void gather_cell_lists(const kernels::TraceGrid& grid, std::size_t brick, float margin, CellLists& lists);

// The i-th group of 16 balls of a list; places beyond its end are never hit.
kernels::BallBundle make_bundle(const kernels::TraceGrid& grid, const std::uint32_t* ball, std::size_t count);

}  // namespace firn
