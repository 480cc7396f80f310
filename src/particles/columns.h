// SPDX-License-Identifier: MIT
// The particles as a structure of arrays: one 64-byte-aligned arena cut into columns of four bytes a
// particle, each padded to 16 and set off from the last by an odd number of cache lines, so that a kernel's
// streams do not alias. One spare column lets a permutation go column by column: gather into the spare, then
// the two trade places.
#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/mpm/views.h"
#include "src/particles/fields.h"

namespace firn {

class ParticleColumns {
 public:
  // Room for `count` particles, whose columns are left to be written: until then a large column takes no
  // memory.
  void allocate(std::size_t count);

  std::size_t size() const { return size_; }
  kernels::ParticleView view() const { return std::bit_cast<kernels::ParticleView>(head_of_columns()); }
  std::size_t resident_bytes() const { return arena_bytes_; }

  // Column k, in the order of kFields, as raw words.
  std::uint32_t* column(std::size_t k) { return columns_[k]; }
  const std::uint32_t* column(std::size_t k) const { return columns_[k]; }

  // One word a particle for whatever is needed between two calls of permute(), which overwrites it.
  std::uint32_t* scratch() { return columns_[kColumns]; }

  // Particle i becomes what particle order[i] was; particles that `order` leaves out are gone.
  void permute(const std::vector<std::uint32_t>& order);

 private:
  using Pointers = std::array<std::uint32_t*, kColumns>;
  Pointers head_of_columns() const;
  struct Free {
    void operator()(void* p) const;
  };
  std::unique_ptr<std::byte, Free> arena_;
  std::size_t arena_bytes_ = 0;
  std::size_t size_ = 0;
  std::array<std::uint32_t*, kColumns + 1> columns_{};  // the last is the spare
};

static_assert(sizeof(kernels::ParticleView) == kColumns * sizeof(void*));

}  // namespace firn
