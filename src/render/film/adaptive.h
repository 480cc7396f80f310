// SPDX-License-Identifier: MIT
// How many samples a pixel takes: rounds that double the count of all that go on, and after each the pixels
// that are good enough are done. What is decided depends on the film alone.
#pragma once
#include <cstdint>

#include "src/render/film/film.h"
#include "src/render/film/tile.h"

namespace firn {

struct SampleRange {
  std::uint32_t first = 0, last = 0;  // half open
};

// The round after `last`, of `samples` in all: 16 samples, 16, 32, 64, ...; all at once if not `adaptive`.
SampleRange next_round(std::uint32_t last, std::uint32_t samples, bool adaptive);

// The part of a round that belongs to one of `parts` moments; together they are the round.
SampleRange share(const SampleRange& round, std::uint32_t part, std::uint32_t parts);

// Takes those pixels out of `wanted` whose standard error is at most `noise` of their luminance. The error is
// the larger of the pixel's own and that of the 3 x 3 pixels about it (few samples tell little of their
// variance: one that has not yet seen a bright path must not stop for it), the luminance is the mean there
// and one percent of the picture's, so that black does not go on for ever.
void drop_finished(const Film& film, double noise, PixelSet& wanted);

}  // namespace firn
