// SPDX-License-Identifier: MIT
// What shading asks about many points at once. In and out: columns, one entry a point. Neighbours in the
// columns should be neighbours in space: points of a block of pixels are. What a point gets does not depend
// on the others.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/trace/table.h"

namespace firn::kernels {

// Three columns of the same length: places, directions.
struct Columns3 {
  const float* at[3];
};

// The gradients of the fill at the corners of the bricks that the surface crosses.
struct GradientField {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  const std::uint32_t* place = nullptr;  // per occupied brick: its place in `value`, or kNone
  const float* value = nullptr;          // 1/m; per crossed brick kBrickCorners x 3
};

// The grain of a point: src/render/snow/grain.h.
struct GrainView {
  Columns3 smooth;          // unit normal
  Columns3 local;           // from the particle's centre, in particle spacings
  Columns3 back;            // unit, towards the eye
  const std::uint32_t* id;  // of the particle
};

// The facets of one kind of snow (src/render/snow/facets.h); lengths in m.
struct FacetCells {
  float radius, cell, inv_cell;
  float chord;        // of the cone of a facet's normals
  int side;           // cells of direction along an edge of the cube
  float step;         // 2 / side
  double mean, none;  // candidates in a cell, and how often there is none
  float widest;       // m, the most that a facet is spread along the surface
};
struct GlintView {
  const std::uint32_t* id;      // of the particle
  const std::int16_t* turn[3];  // PackedRotation
  Columns3 local;               // m, from the particle's centre; world axes
  Columns3 smooth, back;        // unit normal; towards the eye
  Columns3 light;               // unit, towards the light
  const float* light_chord;     // half of the light's half angle
  const float* footprint;       // m, radius of what a pixel sees
};

// A camera without a lens: pixel (x, y) is seen along forward + pixel ((x + 1/2 - center[0]) right +
// (y + 1/2 - center[1]) down).
struct Pinhole {
  double forward[3], right[3], down[3];  // unit
  double center[2];                      // pixels, of the film
  double pixel;                          // side of a pixel at distance 1
};

// Which random numbers of which paths: src/render/sampling/sampler.h.
struct DrawView {
  const std::uint64_t* key;       // of the path's Sampler
  const std::uint32_t* sample;    // of its pixel
  const std::uint32_t* number;    // which of its pairs
  std::uint32_t within, ordered;  // pairs with (number & within) < ordered are of low discrepancy
};

// Lights at infinity, chosen by strength: first the suns, then the sky.
struct DistantSun {
  float direction[3], side[3], up[3];  // unit, a frame
  float spread;                        // 1 - cos(angular radius)
  float strength;
};
// A sky's directions as rows and columns of equal solid angle: src/render/lights/sky.h. The chances of the
// rows and of the cells of each row, summed up to and with each.
struct SkyTable {
  const float *until_row = nullptr, *until_cell = nullptr;
  int rows = 0, columns = 1;  // rows: 0 if it is black
};
struct DistantLights {
  const DistantSun* suns = nullptr;
  std::size_t sun_count = 0;
  SkyTable sky;
  float strength = 0;  // of all
};

struct ShadeKernels {
  // Of the middle of each pixel the unit direction, and the radius of what the pixel sees there at 1 m
  // across the ray (m): half the root of its solid angle.
  void (*sights)(const Pinhole&, const std::int32_t* x, const std::int32_t* y, std::size_t begin,
                 std::size_t end, float* const direction[3], float* spread) = nullptr;
  // The sorted index of the particle whose centre is nearest to each point; kNoHit if none is nearer than a
  // cell is wide. Of equal distances the lowest index.
  void (*nearest)(const TraceGrid&, const Columns3& point, std::size_t begin, std::size_t end,
                  std::uint32_t* particle) = nullptr;
  // The unit normal at each point, against the gradient, which is trilinear between the corners; 0 where
  // there is none.
  void (*normals)(const TraceGrid&, const GradientField&, const Columns3& point, std::size_t begin,
                  std::size_t end, float* const normal[3]) = nullptr;
  // The unit normal with grain; one that looks away from the eye is turned until it sees it edge on.
  void (*grain)(const GrainView&, std::size_t begin, std::size_t end, float* const normal[3]) = nullptr;
  // 0 for points where no facet shines: the others are few, and may.
  void (*may_glint)(const FacetCells&, const GlintView&, std::size_t begin, std::size_t end,
                    std::uint8_t* glints) = nullptr;
  // The pairs of random numbers with `plus` added to their own numbers; in [0, 1).
  void (*pairs)(const DrawView&, std::uint32_t plus, std::size_t begin, std::size_t end, float* u,
                float* v) = nullptr;
  // The same as keys of more random numbers.
  void (*keys)(const DrawView&, std::uint32_t plus, std::size_t begin, std::size_t end,
               std::uint64_t* key) = nullptr;
  // Unit directions to lights, chosen by `choice`, to the place of them that u and v say; all in [0, 1).
  void (*distant_directions)(const DistantLights&, const float* choice, const float* u, const float* v,
                             std::size_t begin, std::size_t end, float* const direction[3]) = nullptr;
};

}  // namespace firn::kernels
