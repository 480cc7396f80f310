// SPDX-License-Identifier: MIT
// Which of a path's random numbers is for what: pairs of sample dimensions, five for the start of a subpath,
// then five for each of its vertices, in a stream each for eye subpaths, light subpaths and what connects
// them.
#pragma once
#include <cstdint>

namespace firn {

inline constexpr std::uint32_t kEyes = 0, kLights = 1u << 30, kLinks = 1u << 31;
inline constexpr std::uint32_t kFilmPoint = 0, kLensPoint = 1, kLightChoice = 2, kLightPlace = 3,
                               kLightDirection = 4;
inline constexpr std::uint32_t kChoiceOfLight = 0, kPointOfLight = 1, kScattering = 2, kLobeAndRoulette = 3,
                               kSight = 4;
inline constexpr std::uint32_t kChoiceOfGlint = kLightChoice, kPointOfGlint = kLightPlace;  // of eye subpaths
constexpr std::uint32_t pair_of(int vertices, std::uint32_t which) {
  return 5 * static_cast<std::uint32_t>(vertices) + which;
}

inline constexpr std::uint32_t kEmergence = 0;                    // among the numbers of links
inline constexpr std::uint32_t kWalkLinks = kLinks + (1u << 29);  // of walks, one a vertex

}  // namespace firn
