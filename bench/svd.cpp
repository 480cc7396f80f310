// SPDX-License-Identifier: MIT
#include "bench/svd.h"

#include <Eigen/SVD>

#include "bench/stopwatch.h"
#include "src/core/rng.h"

namespace firn::bench {

namespace {

constexpr int kRepeats = 20;

}  // namespace

Matrices random_matrices(std::size_t count) {
  Matrices out;
  for (std::uint64_t k = 0; k < 9; ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      out.entry[k].push_back(2 * uniform_float(hash_keys(i, k)) - 1);
    }
  }
  return out;
}

double time_svd(const kernels::KernelTable& kernels, const Matrices& matrices) {
  const std::size_t count = matrices.size();
  std::vector<float> storage(21 * count);
  const float* in[9];
  float *u[9], *s[3], *v[9];
  for (std::size_t k = 0; k < 9; ++k) {
    in[k] = matrices.entry[k].data();
    u[k] = storage.data() + k * count;
    v[k] = storage.data() + (9 + k) * count;
  }
  for (std::size_t k = 0; k < 3; ++k) s[k] = storage.data() + (18 + k) * count;
  Best best;
  for (int i = 0; i < kRepeats; ++i) best.add(seconds_of([&] { kernels.mpm.svd(in, count, u, s, v); }));
  return 1e9 * best.seconds() / static_cast<double>(count);
}

double time_eigen_svd(const Matrices& matrices) {
  struct Result {
    Eigen::Matrix3f u, v;
    Eigen::Vector3f s;
  };
  const std::size_t count = matrices.size();
  std::vector<Eigen::Matrix3f> in(count);
  std::vector<Result> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 9; ++k) in[i](k / 3, k % 3) = matrices.entry[k][i];
  }
  Best best;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    best.add(seconds_of([&] {
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::JacobiSVD<Eigen::Matrix3f> svd(in[i], Eigen::ComputeFullU | Eigen::ComputeFullV);
        out[i] = {svd.matrixU(), svd.matrixV(), svd.singularValues()};
      }
    }));
  }
  return 1e9 * best.seconds() / static_cast<double>(count);
}

}  // namespace firn::bench
