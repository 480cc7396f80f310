// SPDX-License-Identifier: MIT
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

Extent extent(const float*, std::size_t, std::size_t);  // bin.cpp
void cell_codes(const TraceGrid&, const float* const[3], const float[3], std::size_t, std::size_t,
                std::uint32_t*);                                                    // bin.cpp
void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);           // stream.cpp
void closest_coherent(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // packet.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);          // stream.cpp

TraceKernels trace_kernels() { return {extent, cell_codes, closest, closest_coherent, occluded}; }

}  // namespace firn::kernels::FIRN_ISA
