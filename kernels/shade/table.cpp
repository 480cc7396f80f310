// SPDX-License-Identifier: MIT
#include "kernels/shade/table.h"

namespace firn::kernels::FIRN_ISA {

void sights(const Pinhole&, const std::int32_t*, const std::int32_t*, std::size_t, std::size_t,
            float* const[3], float*);                                                       // sight.cpp
void nearest(const TraceGrid&, const Columns3&, std::size_t, std::size_t, std::uint32_t*);  // nearest.cpp
void normals(const TraceGrid&, const GradientField&, const Columns3&, std::size_t, std::size_t,
             float* const[3]);                                                 // normals.cpp
void grain(const GrainView&, std::size_t, std::size_t, float* const[3]);       // grain.cpp
void may_glint(const FacetCells&, const GlintView&, std::size_t, std::size_t,  // glint.cpp
               std::uint8_t*);
void pairs(const DrawView&, std::uint32_t, std::size_t, std::size_t, float*, float*);    // draws.cpp
void keys(const DrawView&, std::uint32_t, std::size_t, std::size_t, std::uint64_t*);     // draws.cpp
void distant_directions(const DistantLights&, const float*, const float*, const float*,  // distant.cpp
                        std::size_t, std::size_t, float* const[3]);

ShadeKernels shade_kernels() {
  return {sights, nearest, normals, grain, may_glint, pairs, keys, distant_directions};
}

}  // namespace firn::kernels::FIRN_ISA
