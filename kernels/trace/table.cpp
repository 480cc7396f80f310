// SPDX-License-Identifier: MIT
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);           // stream.cpp
void closest_coherent(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // packet.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);          // stream.cpp

TraceKernels trace_kernels() { return {closest, closest_coherent, occluded}; }

}  // namespace firn::kernels::FIRN_ISA
