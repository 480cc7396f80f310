// SPDX-License-Identifier: MIT
// Numbers by block key: a hash table with open addressing that is filled by one thread, then read by many.
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "src/particles/blocks.h"

namespace firn {

class BlockTable {
 public:
  // Grows when there are more keys than expected.
  explicit BlockTable(std::size_t expected) { clear(std::bit_ceil(2 * std::max<std::size_t>(expected, 8))); }

  // Returns false if the key is there already.
  bool insert(BlockKey key) {
    Slot& slot = slot_of(key);
    if (slot.key == key) return false;
    slot.key = key;
    if (2 * ++count_ > slots_.size()) grow();
    return true;
  }
  std::uint32_t& number(BlockKey key) { return slot_of(key).number; }  // of an inserted key; 0 at first

 private:
  static constexpr BlockKey kEmpty = ~BlockKey{0};
  struct Slot {
    BlockKey key = kEmpty;
    std::uint32_t number = 0;
  };

  void clear(std::size_t slots) {
    slots_.assign(slots, {});
    shift_ = 64 - std::countr_zero(slots);
  }
  // Where the key is, or the empty slot where it belongs. Multiplying by 2^64 / golden ratio spreads keys.
  Slot& slot_of(BlockKey key) {
    std::size_t at = key * 0x9e3779b97f4a7c15ull >> shift_;
    while (slots_[at].key != key && slots_[at].key != kEmpty) at = (at + 1) & (slots_.size() - 1);
    return slots_[at];
  }
  void grow() {
    const std::vector<Slot> old = std::move(slots_);
    clear(2 * old.size());
    for (const Slot& slot : old) {
      if (slot.key != kEmpty) slot_of(slot.key) = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
  int shift_ = 0;
};

}  // namespace firn
