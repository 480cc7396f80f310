// SPDX-License-Identifier: MIT
// Who ran when, as a picture: stage intervals in, the JSON of Chrome's trace viewer out (chrome://tracing,
// Perfetto). One row a stage rather than one a thread: the overlap of simulate(k+1), trace(k) and write(k-1)
// is what is looked for.
#pragma once
#include <string>
#include <vector>

#include "src/graph/frame_graph.h"

namespace firn {

// Complete events ("ph": "X") in microseconds since the start of the run; args hold the frame and the arena's
// thread.
std::string chrome_trace(const std::vector<StageInterval>& intervals);

}  // namespace firn
