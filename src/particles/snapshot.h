// SPDX-License-Identifier: MIT
// The columns of a snapshot that particle files and hashes hold, in their order.
#pragma once
#include "firn/snapshot.h"

namespace firn {

// Visit gets each column as a span.
template <class AnySnapshot, class Visit>
void for_each_stored_column(AnySnapshot& snapshot, Visit&& visit) {
  for (std::size_t k = 0; k < 3; ++k) visit(snapshot.position[k]);
  for (std::size_t k = 0; k < 3; ++k) visit(snapshot.velocity[k]);
  visit(std::span(snapshot.density.data(), snapshot.size()));
  visit(std::span(snapshot.volume0.data(), snapshot.size()));
  for (std::size_t k = 0; k < 3; ++k) visit(snapshot.rotation[k]);
  visit(std::span(snapshot.id.data(), snapshot.size()));
  visit(std::span(snapshot.object.data(), snapshot.size()));
}

}  // namespace firn
