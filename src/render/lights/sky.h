// SPDX-License-Identifier: MIT
// All light that comes from infinity and is no sun's disc: gradients, the day sky, pictures and constant
// light, added up. Directions are sampled from a table of cells of equal solid angle (even in height and
// azimuth), by the mean radiance in each; a tenth of all samples is uniform, so that nothing is missed that a
// cell hides.
#pragma once
#include <vector>

#include "kernels/shade/table.h"
#include "src/render/lights/day_sky.h"
#include "src/render/sampling/sampler.h"
#include "src/render/setup.h"

namespace firn {

class Sky {
 public:
  explicit Sky(const std::vector<Light>& lights);  // takes what is its own

  Vec3f radiance(const Vec3f& d) const;         // from the unit direction d
  float strength() const { return strength_; }  // integral over all directions of the channels' sum
  Vec3f sample(Sample2 at) const;
  float density(const Vec3f& d) const;  // of sample(), 1/sr
  kernels::SkyTable table() const;      // what sample() chooses by

 private:
  struct Image {
    ImageLight light;
    float turn;  // of the picture, as a part of a full turn
  };

  void tabulate();
  std::size_t cell_of(const Vec3f& d) const;

  Vec3f constant_ = Vec3f::Zero();
  std::vector<SkyLight> gradients_;
  std::vector<DaySky> days_;
  std::vector<Image> images_;

  int columns_ = 1, rows_ = 1;
  std::vector<float> until_row_;   // chance of all rows up to each
  std::vector<float> until_cell_;  // chance of all cells of its row up to each
  std::vector<float> density_;     // 1/sr, of each cell
  float strength_ = 0;
};

}  // namespace firn
