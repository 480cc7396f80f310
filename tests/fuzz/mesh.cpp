// SPDX-License-Identifier: MIT
#include "src/geometry/mesh.h"

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {

void mesh(std::string_view input) {
  const TriangleMesh mesh = load_obj(MemoryFile(input).path(), 0.5);
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(0.1, -0.2, 0.3), Vec3(-1e6, 1, 1e6)}) mesh.closest(p);
  for (const Vec3& vertex : mesh.vertices()) require(vertex.allFinite(), "a vertex has a place");
  const int count = static_cast<int>(mesh.vertices().size());
  for (const Triangle& triangle : mesh.triangles()) {
    for (const int k : triangle) require(k >= 0 && k < count, "a triangle has vertices that are there");
  }
}

}  // namespace firn::fuzz
