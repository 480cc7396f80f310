// SPDX-License-Identifier: MIT
// Embree's header, of the version that meson found.
#pragma once
#if FIRN_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
