// SPDX-License-Identifier: MIT
// In: PGM or ESRI ASCII grid files. Out: a HeightRaster. Both formats are a short header and numbers, so one
// reader does for each and no picture library is needed.
#include "src/geometry/height_field.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <utility>

#include "firn/error.h"
#include "src/core/text.h"

namespace firn {
namespace {

constexpr int kMaxSide = 16384;  // samples; larger counts are taken for a damaged header

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::io, path, what);
}

void require_side(const std::string& path, double count) {
  if (!(count >= 2 && count <= kMaxSide)) {
    refuse(path, "a height raster needs 2 to " + std::to_string(kMaxSide) + " columns and rows");
  }
}

// The next number of a PGM header; '#' starts a comment.
int header_number(std::istream& in, const std::string& path) {
  while ((in >> std::ws) && in.peek() == '#') {
    std::string comment;
    std::getline(in, comment);
  }
  int value = 0;
  if (!(in >> value) || value < 1) refuse(path, "has a damaged PGM header");
  return value;
}

double pgm_sample(std::istream& in, bool text, bool wide) {
  if (text) {
    int value = 0;
    in >> value;
    return value;
  }
  int value = in.get();
  if (wide) value = value * 256 + in.get();
  return value;
}

HeightRaster read_pgm(std::istream& in, const std::string& path, bool text,
                      const std::optional<Vec3>& extent) {
  if (!extent) {
    throw Error(ErrorCode::usage, path,
                "a PGM height field needs `extent` = [width, height range, depth] (m)");
  }
  const int columns = header_number(in, path), rows = header_number(in, path), most = header_number(in, path);
  require_side(path, columns);
  require_side(path, rows);
  if (most > 65535) refuse(path, "has a largest grey value above 65535");
  if (!text) in.get();
  std::vector<double> heights;  // grows with the file, whatever its header promises
  for (int left = columns * rows; left > 0; --left) {
    const double sample = pgm_sample(in, text, most > 255);
    if (!in) refuse(path, "ends before its last pixel");
    if (sample < 0 || sample > most) refuse(path, "has a pixel outside of the range that its header tells");
    heights.push_back(sample * extent->y() / most);
  }
  return HeightRaster(columns, rows, std::move(heights), extent->x(), extent->z());
}

// Header lines are "key value" until the first line that starts with a number.
std::map<std::string, double> grid_header(std::istream& in, const std::string& path) {
  std::map<std::string, double> header;
  while ((in >> std::ws) && std::isalpha(in.peek())) {
    std::string key;
    double value = 0;
    if (!(in >> key >> value)) refuse(path, "has a damaged raster header after '" + key + "'");
    header[lower_case(key)] = value;
  }
  for (const char* key : {"ncols", "nrows", "cellsize"}) {
    if (!header.count(key))
      refuse(path, std::string("is neither a PGM nor an ESRI ASCII grid: no '") + key + "'");
  }
  require_side(path, header["ncols"]);
  require_side(path, header["nrows"]);
  if (!(header["cellsize"] > 0)) refuse(path, "has a cell size that is not above 0");
  return header;
}

HeightRaster read_grid(std::istream& in, const std::string& path, const std::optional<Vec3>& extent) {
  const auto header = grid_header(in, path);
  const int columns = static_cast<int>(header.at("ncols")), rows = static_cast<int>(header.at("nrows"));
  std::vector<double> heights;
  double low = 1e300, high = -1e300;
  const auto hole = header.find("nodata_value");
  for (int left = columns * rows; left > 0; --left) {
    double h = 0;
    if (!(in >> h)) refuse(path, "ends before its last height");
    heights.push_back(h);
    if (hole != header.end() && h == hole->second) refuse(path, "has holes (NODATA values): fill them first");
    low = std::min(low, h);
    high = std::max(high, h);
  }
  const double cell = header.at("cellsize");
  if (!std::isfinite(high - low) || !std::isfinite(cell * std::max(columns, rows)))
    refuse(path, "has heights or a cell size that no terrain has");
  if (!extent)
    return HeightRaster(columns, rows, std::move(heights), cell * (columns - 1), cell * (rows - 1));
  for (double& h : heights) h = high > low ? (h - low) / (high - low) * extent->y() : 0;
  return HeightRaster(columns, rows, std::move(heights), extent->x(), extent->z());
}

}  // namespace

HeightRaster::HeightRaster(int columns, int rows, std::vector<double> heights, double width, double depth)
    : columns_(columns), rows_(rows), heights_(std::move(heights)), width_(width), depth_(depth) {
  lowest_ = *std::min_element(heights_.begin(), heights_.end());
  highest_ = *std::max_element(heights_.begin(), heights_.end());
}

HeightSample HeightRaster::sample(double x, double z) const {
  const double u = std::clamp((x / width_ + 0.5) * (columns_ - 1), 0.0, columns_ - 1.0);
  const double v = std::clamp((z / depth_ + 0.5) * (rows_ - 1), 0.0, rows_ - 1.0);
  const int i = std::min(static_cast<int>(u), columns_ - 2), j = std::min(static_cast<int>(v), rows_ - 2);
  const double s = u - i, t = v - j;
  const double h00 = node(i, j), h10 = node(i + 1, j), h01 = node(i, j + 1), h11 = node(i + 1, j + 1);
  const double du = (1 - t) * (h10 - h00) + t * (h11 - h01);
  const double dv = (1 - s) * (h01 - h00) + s * (h11 - h10);
  return {h00 + s * (h10 - h00) + t * ((1 - s) * (h01 - h00) + s * (h11 - h10)), du * (columns_ - 1) / width_,
          dv * (rows_ - 1) / depth_};
}

double HeightRaster::volume_above(double base) const {
  constexpr int kParts = 8;  // sub-samples a side of a cell that the base cuts
  double sum = 0;
  for (int j = 0; j + 1 < rows_; ++j) {
    for (int i = 0; i + 1 < columns_; ++i) {
      const double h[4] = {node(i, j) - base, node(i + 1, j) - base, node(i, j + 1) - base,
                           node(i + 1, j + 1) - base};
      if (*std::min_element(h, h + 4) >= 0) {
        sum += 0.25 * (h[0] + h[1] + h[2] + h[3]);
        continue;
      }
      for (int k = 0; k < kParts * kParts; ++k) {
        const int column = k % kParts, row = k / kParts;
        const double s = (column + 0.5) / kParts, t = (row + 0.5) / kParts;
        const double height = (1 - t) * ((1 - s) * h[0] + s * h[1]) + t * ((1 - s) * h[2] + s * h[3]);
        sum += std::max(0.0, height) / (kParts * kParts);
      }
    }
  }
  return sum * width_ / (columns_ - 1) * depth_ / (rows_ - 1);
}

HeightRaster load_height_raster(const std::string& path, const std::optional<Vec3>& extent) {
  std::ifstream in(path, std::ios::binary);
  if (!in) refuse(path, "no such height field file");
  char magic[2] = {};
  in.read(magic, 2);
  if (magic[0] == 'P' && (magic[1] == '2' || magic[1] == '5'))
    return read_pgm(in, path, magic[1] == '2', extent);
  in.clear();
  in.seekg(0);
  return read_grid(in, path, extent);
}

}  // namespace firn
