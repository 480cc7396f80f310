// SPDX-License-Identifier: MIT
// Memory for the kernels' arrays: on a cache-line boundary, and in huge pages where it is large, since a step
// reads some thirty columns at once and would miss the address translation cache on each.
#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

namespace firn {

// Uninitialised; to be given to std::free. Throws std::bad_alloc.
void* allocate_aligned(std::size_t bytes);

// A flat array that only grows and starts uninitialised: storage for blocks of the grid, which kernels
// overwrite whole.
template <class T>
class AlignedArray {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  // Room for `count` entries; what was stored is lost when it has to grow.
  void reserve_discarding(std::size_t count) {
    if (count <= capacity_) return;
    const std::size_t bytes = ((count + count / 8) * sizeof(T) + 63) / 64 * 64;
    data_.reset();
    data_.reset(static_cast<T*>(allocate_aligned(bytes)));
    capacity_ = bytes / sizeof(T);
  }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  std::size_t resident_bytes() const { return capacity_ * sizeof(T); }

 private:
  struct Free {
    void operator()(T* p) const { std::free(p); }
  };
  std::unique_ptr<T, Free> data_;
  std::size_t capacity_ = 0;
};

}  // namespace firn
