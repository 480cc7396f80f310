// SPDX-License-Identifier: MIT
#include "kernels/mpm/table.h"

namespace firn::kernels::FIRN_ISA {

namespace {

template <class Pointer>
struct Function;
template <class T>
struct Function<T*> {
  using Type = T;
};

}  // namespace

// Defined one a file beside this one; the table's types declare them.
Function<decltype(MpmKernels::p2g)>::Type p2g;
Function<decltype(MpmKernels::reduce_tiles)>::Type reduce_tiles;
Function<decltype(MpmKernels::grid_update)>::Type grid_update;
Function<decltype(MpmKernels::assemble_tile)>::Type assemble_tile;
Function<decltype(MpmKernels::g2p)>::Type g2p;
Function<decltype(MpmKernels::summarise)>::Type summarise;
Function<decltype(MpmKernels::elastic_energy)>::Type elastic_energy;
Function<decltype(MpmKernels::stress)>::Type stress;
Function<decltype(MpmKernels::project)>::Type project;
Function<decltype(MpmKernels::svd)>::Type svd;

MpmKernels mpm_kernels() {
  return {p2g,       reduce_tiles,   grid_update, assemble_tile, g2p,
          summarise, elastic_energy, stress,      project,       svd};
}

}  // namespace firn::kernels::FIRN_ISA
