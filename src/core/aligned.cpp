// SPDX-License-Identifier: MIT
#include "src/core/aligned.h"

#include <sys/mman.h>

namespace firn {

void* allocate_aligned(std::size_t bytes) {
  constexpr std::size_t line = 64, huge_page = std::size_t{2} << 20;
  const bool large = bytes >= 2 * huge_page;
  const std::size_t alignment = large ? huge_page : line;
  void* p = nullptr;  // std::aligned_alloc takes multiples of the alignment only: up to 2 MiB more
  if (::posix_memalign(&p, alignment, bytes) != 0) throw std::bad_alloc();
  if (large) madvise(p, bytes, MADV_HUGEPAGE);  // a wish: without huge pages it is only slower
  return p;
}

}  // namespace firn
