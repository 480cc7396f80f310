// SPDX-License-Identifier: MIT
// metrics.csv: what the snow did, one row a frame, on the disk as soon as the frame is. The header names the
// units, and the colliders whose forces the last columns are: force_x_N[ground], ... The manifest holds the
// same numbers, so a session writes the rows of earlier ones anew, whatever has happened to them.
#pragma once
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "src/io/manifest.h"
#include "src/mpm/solver.h"

namespace firn {

class MetricsCsv {
 public:
  explicit MetricsCsv(const std::filesystem::path& path) : path_(path) {}
  // The file as it is after these frames; none without a frame, since the columns are not known yet.
  void replace(const std::vector<FrameRecord>& frames);
  void add(int frame, const Metrics& metrics);

 private:
  std::filesystem::path path_;
  std::ofstream out_;  // closed until there is a row
};

}  // namespace firn
