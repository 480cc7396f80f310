// SPDX-License-Identifier: MIT
#include "src/particles/columns.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <cstring>

#include "src/core/aligned.h"
#include "src/core/parallel.h"
#include "src/particles/column_bytes.h"

namespace firn {

void ParticleColumns::Free::operator()(void* p) const { std::free(p); }

void ParticleColumns::allocate(std::size_t count) {
  const std::size_t stride = column_bytes(count, sizeof(std::uint32_t));
  arena_bytes_ = stride * columns_.size();
  arena_.reset(static_cast<std::byte*>(allocate_aligned(arena_bytes_)));
  const std::size_t used = count * sizeof(std::uint32_t);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    std::byte* const column = arena_.get() + k * stride;
    std::memset(column + used, 0, stride - used);
    columns_[k] = reinterpret_cast<std::uint32_t*>(column);
  }
  size_ = count;
}

ParticleColumns::Pointers ParticleColumns::head_of_columns() const {
  Pointers pointers;
  std::copy_n(columns_.begin(), kColumns, pointers.begin());
  return pointers;
}

void ParticleColumns::permute(const std::vector<std::uint32_t>& order) {
  assert(order.size() <= size_);
  for (std::size_t k = 0; k < kColumns; ++k) {
    const std::uint32_t* from = columns_[k];
    std::uint32_t* to = columns_[kColumns];
    parallel_chunks(order.size(), 16384, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) to[i] = from[order[i]];
    });
    std::swap(columns_[k], columns_[kColumns]);
  }
  size_ = order.size();
}

}  // namespace firn
