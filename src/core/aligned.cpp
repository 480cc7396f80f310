// SPDX-License-Identifier: MIT
#include "src/core/aligned.h"

#include <sys/mman.h>

namespace firn {

void* allocate_aligned(std::size_t bytes) {
  constexpr std::size_t line = 64, huge_page = std::size_t{2} << 20;
  const bool large = bytes >= 2 * huge_page;
  const std::size_t alignment = large ? huge_page : line;
  const std::size_t padded = (bytes + line - 1) / line * line;
  void* const p = std::aligned_alloc(alignment, padded);
  if (!p) throw std::bad_alloc();
  if (large) madvise(p, padded, MADV_HUGEPAGE);  // a wish: without huge pages it is only slower
  return p;
}

}  // namespace firn
