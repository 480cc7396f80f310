// SPDX-License-Identifier: MIT
// In: a Wavefront OBJ file. Out: a TriangleMesh. The only file that knows tinyobjloader.
#include <tiny_obj_loader.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "firn/error.h"
#include "src/geometry/mesh.h"

namespace firn {
namespace {

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

constexpr std::string_view kBlank = " \t";

std::vector<std::string_view> words_of(std::string_view line) {
  line = line.substr(0, line.find('#'));
  std::vector<std::string_view> words;
  for (std::size_t begin, end = 0; (begin = line.find_first_not_of(kBlank, end)) != std::string_view::npos;) {
    end = std::min(line.find_first_of(kBlank, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
  }
  return words;
}

// Whether all of the word is one number; of a double also one that no double holds, as 1e999.
template <class T>
bool is_number(std::string_view word) {
  if (std::is_floating_point_v<T> && word.starts_with('+')) word.remove_prefix(1);
  T value;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return end == word.data() + word.size() &&
         (error == std::errc{} || (std::is_floating_point_v<T> && error == std::errc::result_out_of_range));
}

// "7", "7/1", "7//2" or "7/1/2".
bool is_corner(std::string_view word) {
  for (int part = 0; part < 3; ++part) {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const bool may_be_absent = part == 1 && slash < word.size();
    if (!is_number<int>(word.substr(0, slash)) && !(may_be_absent && slash == 0)) return false;
    if (slash == word.size()) return true;
    word.remove_prefix(slash + 1);
  }
  return false;
}

// tinyobjloader takes 0 for a number that it cannot read and passes over faces of two corners. Errors: io
// Error at the line and column of the first of these.
void check_lines(std::string_view text, const std::string& path) {
  std::size_t number = 1;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    const std::vector<std::string_view> words = words_of(line);
    const auto refuse = [&](std::string_view at, const std::string& what) {
      throw Error(ErrorCode::io,
                  path + ":" + std::to_string(number) + ":" + std::to_string(at.data() - line.data() + 1),
                  what);
    };
    const bool vertex = !words.empty() && words[0] == "v", face = !words.empty() && words[0] == "f";
    if ((vertex || face) && words.size() < 4)
      refuse(words[0], vertex ? "a vertex needs 3 numbers" : "a face needs 3 corners");
    for (std::size_t i = 1; i < words.size(); ++i) {
      if (vertex && !is_number<double>(words[i]))
        refuse(words[i], "expected a number, got '" + std::string(words[i]) + "'");
      if (face && !is_corner(words[i]))
        refuse(words[i], "expected a corner as 7, 7/1, 7//2 or 7/1/2, got '" + std::string(words[i]) + "'");
    }
    begin = end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
  }
}

}  // namespace

TriangleMesh load_obj(const std::string& path, double scale) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) throw Error(ErrorCode::io, path, "no such mesh file");
  tinyobj::ObjReader reader;
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  // From a string, for the reader of files also reads, without end, whatever file a "mtllib" line names.
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  check_lines(text, path);
  if (!in || !reader.ParseFromString(text, "", config)) {
    throw Error(ErrorCode::io, path, "cannot be read as an OBJ mesh: " + first_line(reader.Error()));
  }
  std::vector<Vec3> vertices;
  const auto& coordinates = reader.GetAttrib().vertices;
  for (std::size_t i = 0; i + 2 < coordinates.size(); i += 3) {
    vertices.push_back(scale * Vec3(coordinates[i], coordinates[i + 1], coordinates[i + 2]));
    if (!vertices.back().allFinite()) throw Error(ErrorCode::io, path, "has a vertex at no finite place");
  }
  std::vector<Triangle> triangles;
  for (const auto& shape : reader.GetShapes()) {
    const auto& corners = shape.mesh.indices;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      triangles.push_back(
          {corners[i].vertex_index, corners[i + 1].vertex_index, corners[i + 2].vertex_index});
    }
  }
  if (triangles.empty()) throw Error(ErrorCode::io, path, "holds no faces");
  try {
    return TriangleMesh(vertices, triangles);
  } catch (const Error& error) {
    throw Error(error.code(), path, error.what());
  }
}

}  // namespace firn
