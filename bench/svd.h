// SPDX-License-Identifier: MIT
// The batched SVD beside Eigen's, over the same matrices.
#pragma once
#include <cstddef>
#include <vector>

#include "kernels/table.h"

namespace firn::bench {

// Row-major entries of 3x3 matrices, one column each.
struct Matrices {
  std::vector<float> entry[9];
  std::size_t size() const { return entry[0].size(); }
};

// Entries uniform in [-1, 1), from a fixed seed.
Matrices random_matrices(std::size_t count);

// ns a matrix, the best of some repeats; U, s and V are computed and stored.
double time_svd(const kernels::KernelTable& kernels, const Matrices& matrices);
double time_eigen_svd(const Matrices& matrices);

}  // namespace firn::bench
