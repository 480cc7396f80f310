// SPDX-License-Identifier: MIT
#pragma once

namespace firn {

// Where the preview's time goes: s, of all threads together.
struct PreviewTimes {
  double primary = 0, shadow = 0, shade = 0;

  void add(const PreviewTimes& other) {
    primary += other.primary, shadow += other.shadow, shade += other.shade;
  }
};

}  // namespace firn
