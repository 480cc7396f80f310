// SPDX-License-Identifier: MIT
// In: a Wavefront OBJ file. Out: a TriangleMesh. The only file that knows tinyobjloader.
#include <tiny_obj_loader.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "src/core/error.h"
#include "src/geometry/mesh.h"

namespace firn {
namespace {

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

TriangleMesh load_obj(const std::string& path, double scale) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) throw Error(ExitCode::io, path, "no such mesh file");
  tinyobj::ObjReader reader;
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  // From a string, for the reader of files also reads, without end, whatever file a "mtllib" line names.
  std::ifstream in(path, std::ios::binary);
  if (!in || !reader.ParseFromString({std::istreambuf_iterator<char>(in), {}}, "", config)) {
    throw Error(ExitCode::io, path, "cannot be read as an OBJ mesh: " + first_line(reader.Error()));
  }
  std::vector<Vec3> vertices;
  const auto& coordinates = reader.GetAttrib().vertices;
  for (std::size_t i = 0; i + 2 < coordinates.size(); i += 3) {
    vertices.push_back(scale * Vec3(coordinates[i], coordinates[i + 1], coordinates[i + 2]));
    if (!vertices.back().allFinite()) throw Error(ExitCode::io, path, "has a vertex at no finite place");
  }
  std::vector<Triangle> triangles;
  for (const auto& shape : reader.GetShapes()) {
    const auto& corners = shape.mesh.indices;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      triangles.push_back(
          {corners[i].vertex_index, corners[i + 1].vertex_index, corners[i + 2].vertex_index});
    }
  }
  if (triangles.empty()) throw Error(ExitCode::io, path, "holds no faces");
  try {
    return TriangleMesh(vertices, triangles);
  } catch (const Error& error) {
    throw Error(error.code(), path, error.what());
  }
}

}  // namespace firn
