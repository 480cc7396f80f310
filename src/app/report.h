// SPDX-License-Identifier: MIT
// What a run says at its end: where things are, and the table of what it cost.
#pragma once
#include <string>
#include <vector>

#include "src/graph/frame_graph.h"
#include "src/io/manifest.h"
#include "src/io/run_folder.h"

namespace firn {

// Timings are of the whole run, the overlap (sum of stage times over wall time) of this session's intervals.
std::string closing_report(const RunFolder& folder, const Manifest& manifest,
                           const std::vector<StageInterval>& intervals);

std::string grouped(std::uint64_t number);  // 1234567 -> "1,234,567"
std::string mebibytes(double bytes);        // "12.3 MiB"

}  // namespace firn
