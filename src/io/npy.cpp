// SPDX-License-Identifier: MIT
// The header of an array is the text of a Python dictionary (NumPy, "NEP 1: A simple file format for NumPy
// arrays", and numpy.lib.format for versions 2 and 3), of which just the values that NumPy writes are
// understood:
//   {'descr': '<f8', 'fortran_order': False, 'shape': (1000, 3), }
#include "src/io/npy.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <vector>

#include "firn/error.h"
#include "src/io/byte_stream.h"
#include "src/io/scalar.h"
#include "src/io/zip.h"

namespace firn {
namespace {

constexpr std::string_view kArrayMark = "\x93NUMPY";

struct Array {
  std::string where;  // for errors: the file and the array's name
  std::vector<std::size_t> shape;
  ScalarType type{};
  bool columns_first = false;  // Fortran's order
  std::string_view values;

  std::string shape_text() const {
    std::string text = "(";
    for (const std::size_t n : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
    return text + (shape.size() == 1 ? ",)" : ")");
  }
  std::size_t count() const { return values.size() / type.bytes; }
  double at(std::size_t index) const { return read_scalar(type, values.data() + index * type.bytes); }
  // Component `part` of row i, of `parts` in a row.
  double at(std::size_t i, std::size_t part) const {
    return at(columns_first ? fortran_place(i, part) : i * (count() / shape[0]) + part);
  }

 private:
  std::size_t fortran_place(std::size_t i, std::size_t part) const {
    std::size_t place = i, stride = shape[0], below = count() / shape[0];
    for (std::size_t axis = 1; axis < shape.size(); ++axis) {
      below /= shape[axis];
      place += stride * (part / below % shape[axis]);
      stride *= shape[axis];
    }
    return place;
  }
};

[[noreturn]] void refuse_array(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::io, where, what);
}

// What stands after 'key': in the dictionary, up to the end of the text.
std::string_view value_of(std::string_view header, const std::string& key, const std::string& where) {
  const std::size_t at = header.find("'" + key + "'");
  const std::size_t colon =
      at == std::string_view::npos ? at : header.find_first_not_of(' ', at + key.size() + 2);
  if (colon == std::string_view::npos || header[colon] != ':')
    refuse_array(where, "damaged header of a NumPy array: no '" + key + "'");
  const std::size_t value = header.find_first_not_of(' ', colon + 1);
  if (value == std::string_view::npos)
    refuse_array(where, "damaged header of a NumPy array: nothing after '" + key + "'");
  return header.substr(value);
}

ScalarType type_of(std::string_view value, const std::string& where) {
  if (value.front() == '[')
    refuse_array(where, "is an array of records: save each field as an array of its own");
  const std::string_view word = value.substr(1, value.find('\'', 1) - 1);
  if (value.front() != '\'' || word.size() < 2)
    refuse_array(where, "damaged header of a NumPy array: 'descr'");
  if (word[1] == 'O') {
    refuse_array(where,
                 "holds pickled Python objects, which are not read: save an array of numbers, as with "
                 "astype(float)");
  }
  const std::string_view size = word.substr(2);
  const bool real = word[1] == 'f', whole = word[1] == 'i' || word[1] == 'u';
  const bool known =
      real ? size == "4" || size == "8" : whole && (size == "1" || size == "2" || size == "4" || size == "8");
  if (!known || (word[0] != '<' && word[0] != '>' && word[0] != '|' && word[0] != '=')) {
    refuse_array(where, "has numbers of type '" + std::string(word) +
                            "': float32, float64 and whole numbers of 8 to 64 bits are read");
  }
  const auto kind = real             ? ScalarType::Kind::real
                    : word[1] == 'i' ? ScalarType::Kind::integer
                                     : ScalarType::Kind::natural;
  return {kind, static_cast<std::size_t>(size[0] - '0'), word[0] == '>'};
}

std::vector<std::size_t> shape_of(std::string_view value, const std::string& where) {
  const std::size_t end = value.find(')');
  if (value.front() != '(' || end == std::string_view::npos)
    refuse_array(where, "damaged header of a NumPy array: 'shape'");
  std::vector<std::size_t> shape;
  for (std::string_view left = value.substr(1, end - 1); !left.empty();) {
    if (left.front() == ' ' || left.front() == ',') {
      left.remove_prefix(1);
      continue;
    }
    std::size_t n = 0;
    const auto [stop, error] = std::from_chars(left.data(), left.data() + left.size(), n);
    if (error != std::errc{}) refuse_array(where, "damaged header of a NumPy array: 'shape'");
    shape.push_back(n);
    left.remove_prefix(static_cast<std::size_t>(stop - left.data()));
  }
  return shape;
}

// Exactly as many values as the shape says, and not one byte more.
void require_length(const Array& array) {
  std::size_t left = array.values.size();
  bool fits = left % array.type.bytes == 0;
  left /= array.type.bytes;
  const bool none = std::count(array.shape.begin(), array.shape.end(), 0u) > 0;
  for (const std::size_t n : array.shape) {
    if (none || !fits) break;
    fits = left % n == 0;
    left /= n;
  }
  if (fits && left == (none ? 0 : 1)) return;
  refuse_array(array.where, "damaged NumPy array: " + std::to_string(array.values.size()) +
                                " bytes are not one of shape " + array.shape_text());
}

Array parse_array(std::string_view bytes, const std::string& where) {
  ByteReader in(bytes, where);
  if (bytes.substr(0, kArrayMark.size()) != kArrayMark) refuse_array(where, "is not a NumPy array");
  in.take(kArrayMark.size());
  const auto version = in.get<std::uint8_t>();
  in.take(1);
  if (version < 1 || version > 3) {
    refuse_array(where, "is a NumPy array of version " + std::to_string(version) + ": 1, 2 and 3 are read");
  }
  const std::size_t length = version == 1 ? in.get<std::uint16_t>() : in.get<std::uint32_t>();
  const std::string_view header = in.take(length);
  Array array{where, {}, {}, false, {}};
  array.type = type_of(value_of(header, "descr", where), where);
  array.shape = shape_of(value_of(header, "shape", where), where);
  array.columns_first = value_of(header, "fortran_order", where).substr(0, 4) == "True";
  array.values = in.take(in.left());
  require_length(array);
  return array;
}

[[noreturn]] void refuse_shape(const Array& array, const std::string& expected,
                               const std::string& hint = "") {
  refuse_array(array.where, "has shape " + array.shape_text() + ", expected " + expected + hint);
}

std::vector<Vec3> vectors(const Array& array, std::optional<std::size_t> count) {
  const auto& shape = array.shape;
  if (shape.size() != 2 || shape[1] != 3 || shape[0] != count.value_or(shape[0])) {
    const bool turned = shape.size() == 2 && shape[0] == 3 && shape[1] == count.value_or(shape[1]);
    std::string expected = "(";
    expected += count ? std::to_string(*count) : "N";
    expected += ", 3)";
    refuse_shape(array, expected, turned ? ": save its transpose, a row a point" : "");
  }
  std::vector<Vec3> rows(shape[0]);
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = Vec3(array.at(i, 0), array.at(i, 1), array.at(i, 2));
  return rows;
}

std::vector<double> numbers(const Array& array, std::size_t count) {
  const auto& shape = array.shape;
  if (shape.empty()) return std::vector<double>(count, array.at(0));
  if (shape[0] != count || shape.size() > 2 || (shape.size() == 2 && shape[1] != 1))
    refuse_shape(array, "(" + std::to_string(count) + ",) or one number");
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = array.at(i);
  return values;
}

std::vector<Eigen::Matrix3f> matrices(const Array& array, std::size_t count) {
  if (array.shape != std::vector<std::size_t>{count, 3, 3})
    refuse_shape(array, "(" + std::to_string(count) + ", 3, 3)");
  std::vector<Eigen::Matrix3f> rows(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 9; ++k)
      rows[i](static_cast<int>(k / 3), static_cast<int>(k % 3)) = static_cast<float>(array.at(i, k));
  }
  return rows;
}

// What programs call it; the first is firn's own.
const std::vector<std::string> kPosition = {"position", "positions", "points", "pos", "P", "x"},
                               kVelocity = {"velocity", "velocities", "vel", "v"},
                               kVolume = {"volume", "vol"}, kMass = {"mass", "m"},
                               kRadius = {"radius", "pscale"}, kDensity = {"density"}, kPacking = {"Jp"},
                               kStrain = {"F"};

class Archive {
 public:
  Archive(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {
    for (ZipMember& member : zip_members(bytes, where)) {
      std::string name = member.name;
      if (name.ends_with(".npy")) name.resize(name.size() - 4);
      if (!members_.emplace(name, member).second)
        refuse_array(where, "holds two arrays named '" + name + "'");
    }
  }

  // Calls take(array) if one is there. Errors: io Error if there are two names for the same.
  template <class Take>
  bool with(const std::vector<std::string>& names, Take&& take) const {
    std::string found;
    for (const std::string& name : names) {
      if (!members_.count(name)) continue;
      if (!found.empty())
        refuse_array(where_, "holds both '" + found + "' and '" + name + "': which is meant?");
      found = name;
    }
    if (found.empty()) return false;
    const std::string array = unzip(bytes_, members_.at(found), where_);
    take(parse_array(array, where_ + ": array '" + found + "'"));
    return true;
  }

  [[noreturn]] void refuse_without_positions() const {
    std::string names;
    for (const auto& [name, member] : members_) names += (names.empty() ? "" : ", ") + name;
    refuse_array(where_, "holds no array 'position' of shape (N, 3)" +
                             (names.empty() ? ": it is empty" : ", but " + names.substr(0, 200)));
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
  std::map<std::string, ZipMember> members_;
};

}  // namespace

PointCloud decode_npy(std::string_view array, const std::string& where) {
  PointCloud cloud;
  cloud.position = vectors(parse_array(array, where), std::nullopt);
  return cloud;
}

PointCloud decode_npz(std::string_view bytes, const std::string& where) {
  const Archive archive(bytes, where);
  PointCloud cloud;
  if (!archive.with(kPosition, [&](const Array& a) { cloud.position = vectors(a, std::nullopt); }))
    archive.refuse_without_positions();
  const std::size_t count = cloud.size();
  const auto read_numbers = [&](const std::vector<std::string>& names, std::vector<double>& column) {
    archive.with(names, [&](const Array& a) { column = numbers(a, count); });
  };
  archive.with(kVelocity, [&](const Array& a) { cloud.velocity = vectors(a, count); });
  archive.with(kStrain, [&](const Array& a) { cloud.strain = matrices(a, count); });
  read_numbers(kVolume, cloud.volume);
  read_numbers(kMass, cloud.mass);
  read_numbers(kRadius, cloud.radius);
  read_numbers(kDensity, cloud.density);
  read_numbers(kPacking, cloud.packing);
  return cloud;
}

namespace {

// An array in C's order, whose rows are `items`.
template <class Item, class Scalar>
std::string array_of_rows(const std::vector<Item>& items, const std::string& type, const std::string& row,
                          Scalar (*at)(const Item&, std::size_t), std::size_t parts) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" +
                       std::to_string(items.size()) + "," + row + "), }";
  constexpr std::size_t kAligned = 64, kBefore = 10;  // bytes of the mark, the version and the length
  header += std::string(kAligned - (kBefore + header.size() + 1) % kAligned, ' ') + "\n";
  std::string bytes(kArrayMark);
  put(bytes, std::uint16_t{1});
  put(bytes, static_cast<std::uint16_t>(header.size()));
  bytes += header;
  bytes.reserve(bytes.size() + items.size() * parts * sizeof(Scalar));
  for (const Item& item : items) {
    for (std::size_t k = 0; k < parts; ++k) put(bytes, at(item, k));
  }
  return bytes;
}

double part_of_vector(const Vec3& v, std::size_t k) { return v[static_cast<Eigen::Index>(k)]; }
double part_of_number(const double& value, std::size_t) { return value; }
float part_of_matrix(const Eigen::Matrix3f& m, std::size_t k) {
  return m(static_cast<int>(k / 3), static_cast<int>(k % 3));
}

}  // namespace

std::string encode_npz(const PointCloud& cloud) {
  std::vector<std::pair<std::string, std::string>> files;
  const auto add_vectors = [&](const std::string& name, const std::vector<Vec3>& column) {
    if (!column.empty())
      files.emplace_back(name + ".npy", array_of_rows(column, "<f8", " 3", part_of_vector, 3));
  };
  const auto add_numbers = [&](const std::string& name, const std::vector<double>& column) {
    if (!column.empty())
      files.emplace_back(name + ".npy", array_of_rows(column, "<f8", "", part_of_number, 1));
  };
  add_vectors(kPosition[0], cloud.position);
  add_vectors(kVelocity[0], cloud.velocity);
  add_numbers(kVolume[0], cloud.volume);
  add_numbers(kMass[0], cloud.mass);
  add_numbers(kRadius[0], cloud.radius);
  add_numbers(kDensity[0], cloud.density);
  add_numbers(kPacking[0], cloud.packing);
  if (!cloud.strain.empty())
    files.emplace_back(kStrain[0] + ".npy", array_of_rows(cloud.strain, "<f4", " 3, 3", part_of_matrix, 9));
  return zip(files);
}

}  // namespace firn
