// SPDX-License-Identifier: MIT
// Snow below the size of a particle, for close-ups. A particle stands for thousands of grains; the smooth
// surface of few particles looks like plastic. So, before anything is built of it, each particle is drawn as
// a heap of smaller ones that are its own for ever: places and sizes by a hash of its id, in its own frame,
// which turns with it. All else, the surface, what scatters, glints, follows by itself: relief and grain come
// with the finer cells, move with the snow, and cost what so many particles cost.
#pragma once
#include "firn/snapshot.h"

namespace firn {

// Each particle as detail^3 of together its volume, by a tent 1.5 spacings wide. detail >= 1.
Snapshot with_relief(const Snapshot& snapshot, int detail);

}  // namespace firn
