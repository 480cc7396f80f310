// SPDX-License-Identifier: MIT
// Colliders that a program drives in a session, and what a run remembers of them: that it cannot go on
// without.
#include <algorithm>
#include <utility>

#include "src/session/prepare.h"

namespace firn {

void Session::drive(const std::string& collider, ColliderDriver driver) {
  state_->drive(collider, std::move(driver));
}

void Session::State::drive(const std::string& collider, ColliderDriver driver) {
  const std::size_t index = collider_number(scene_, collider, driver);
  if (has_run) throw Error(ErrorCode::usage, "drive", "this session has run already");
  std::vector<std::string>& names = manifest_.driven;
  const bool known = std::binary_search(names.begin(), names.end(), collider);
  if (!known && (!simulated || folder_.opened())) {
    throw Error(ErrorCode::usage, "drive",
                "collider '" + collider +
                    "' was not driven when this run began, and its frames are those of one "
                    "that was not");
  }
  if (simulated) simulated->drive(index, std::move(driver));
  if (!known) names.insert(std::upper_bound(names.begin(), names.end(), collider), collider);
  driven.insert(collider);
}

void Session::State::require_drivers() const {
  if (!simulated) return;
  for (const std::string& name : manifest_.driven) {
    if (driven.count(name)) continue;
    throw Error(ErrorCode::usage, folder_.path().string(),
                "a program drives collider '" + name +
                    "' of this run, and it goes on only in that program: give its driver again "
                    "(Session::drive)");
  }
}

}  // namespace firn
