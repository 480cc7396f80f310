// SPDX-License-Identifier: MIT
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

Extent extent(const float*, std::size_t, std::size_t);  // bin.cpp
void cell_codes(const TraceGrid&, const float* const[3], const float[3], std::size_t, std::size_t,
                std::uint32_t*);                                                    // bin.cpp
void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);           // wave.cpp
void closest_coherent(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // ball_beam.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);          // wave.cpp

void occluded_coherent(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // ball_beam.cpp
void splat(const TraceGrid&, const int[3], std::uint32_t, std::uint32_t, const float*, float*);  // splat.cpp
void sum_tiles(const float* const[27], float*);                                                  // splat.cpp
void surface_closest(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);
void surface_occluded(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);
void surface_closest_coherent(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t,
                              std::size_t);  // surface_beam.cpp
void surface_occluded_coherent(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t,
                               std::size_t);  // surface_beam.cpp
void collide(const TraceGrid&, const MediumField&, const RayView&, const std::uint64_t*, const float*,
             std::size_t,
             std::size_t);  // medium.cpp
void wander(const TraceGrid&, const MediumField&, const WalkView&, const std::uint64_t*, const float*,
            std::size_t, std::size_t);  // medium.cpp

void probe(const TraceGrid&, const float*, const ProbeView&, float, std::size_t, std::size_t,
           float*);  // probe.cpp

double mesh_closest(const MeshView&, const double[3], const double[3], double, std::int32_t&);  // mesh.cpp
bool mesh_occluded(const MeshView&, const double[3], const double[3], double);                  // mesh.cpp

TraceKernels trace_kernels() {
  return {extent,
          cell_codes,
          closest,
          closest_coherent,
          occluded,
          occluded_coherent,
          splat,
          sum_tiles,
          surface_closest,
          surface_occluded,
          surface_closest_coherent,
          surface_occluded_coherent,
          collide,
          wander,
          probe,
          mesh_closest,
          mesh_occluded};
}

}  // namespace firn::kernels::FIRN_ISA
