// SPDX-License-Identifier: MIT
// Vectors as three columns, as the kernels read them.
#pragma once
#include <cstddef>
#include <vector>

#include "kernels/shade/table.h"
#include "src/core/vector.h"

namespace firn {

class VectorColumns {
 public:
  void resize(std::size_t count) {
    for (auto& column : at_) column.resize(count);
  }
  void set(std::size_t i, const Vec3f& v) {
    for (int a = 0; a < 3; ++a) at_[a][i] = v[a];
  }
  Vec3f operator[](std::size_t i) const { return {at_[0][i], at_[1][i], at_[2][i]}; }

  kernels::Columns3 view() const { return {{at_[0].data(), at_[1].data(), at_[2].data()}}; }
  // Calls kernel(columns), which writes them.
  template <class Kernel>
  void fill(Kernel&& kernel) {
    float* const columns[3] = {at_[0].data(), at_[1].data(), at_[2].data()};
    kernel(columns);
  }

 private:
  std::vector<float> at_[3];
};

}  // namespace firn
