// SPDX-License-Identifier: MIT
// metrics.csv: what the snow did, one row a frame, on the disk as soon as the frame is. The header names the
// units, and the colliders whose forces the last columns are: force_x_N[ground], ...
#pragma once
#include <filesystem>
#include <fstream>
#include <string>

#include "src/mpm/simulation.h"

namespace firn {

class MetricsCsv {
 public:
  // Rows of earlier frames than `first` are kept if the file exists, later ones are dropped (they will be
  // written again).
  MetricsCsv(const std::filesystem::path& path, int first);
  void add(int frame, const Metrics& metrics);

 private:
  std::filesystem::path path_;
  std::string kept_;   // rows, until the first new one comes
  std::ofstream out_;  // closed until then
};

}  // namespace firn
