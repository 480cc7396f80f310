// SPDX-License-Identifier: MIT
// A ray against every triangle of a mesh, in double, from where it enters the mesh's bounds. The oracle of
// tests/trace.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/trace/table.h"

namespace firn::kernels::reference {

// As TraceKernels::mesh_closest, over the first `count` triangles of the mesh's columns.
double mesh_closest(const MeshView& mesh, std::size_t count, const double o[3], const double d[3],
                    double limit, std::int32_t& triangle);

}  // namespace firn::kernels::reference
