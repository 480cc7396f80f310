// SPDX-License-Identifier: MIT
// What a run says at its end: where things are, and the table of what it cost. And the lines of tables that
// commands print on stdout.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "src/graph/frame_graph.h"
#include "src/io/manifest.h"
#include "src/io/run_folder.h"

namespace firn {

// Timings are of the whole run, the overlap (sum of stage times over wall time) of this session's intervals.
std::string closing_report(const RunFolder& folder, const Manifest& manifest,
                           const std::vector<StageInterval>& intervals);

// printf's, of at most 255 characters.
template <class... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

void print_line(const std::string& name, const std::string& value);  // of a table of two columns

std::string mebibytes(double bytes);  // "12.3 MiB"

}  // namespace firn
