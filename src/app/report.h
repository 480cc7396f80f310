// SPDX-License-Identifier: MIT
// What a run says at its end: where things are, and the table of what it cost. And the lines of tables that
// commands print on stdout.
#pragma once
#include <string>
#include <vector>

#include "firn/session.h"
#include "src/io/manifest.h"
#include "src/io/run_folder.h"

namespace firn {

// Timings are of the whole run, the overlap (sum of stage times over wall time) of this session's intervals.
std::string closing_report(const RunFolder& folder, const Manifest& manifest,
                           const std::vector<StageInterval>& intervals);
// Of a session that has ended; of a run that others render too, what all of them made, with as many threads
// as this one was asked to have.
std::string closing_report(const Session& session, const std::vector<StageInterval>& intervals, int threads);

void print_line(const std::string& name, const std::string& value);  // of a table of two columns
void print_run(const RunFolder& folder, const Manifest& manifest);   // its table, on stdout

std::string mebibytes(double bytes);  // "12.3 MiB"

}  // namespace firn
