// SPDX-License-Identifier: MIT
// The header tells the elements and their properties in the order of the body. A body is read element by
// element, value by value; whatever the header promises, no more room is taken than the file has bytes for.
#include "src/io/ply.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "firn/error.h"
#include "src/io/scalar.h"

namespace firn {
namespace {

enum class PlyForm { text, little_endian, big_endian };

struct PlyProperty {
  std::string name;
  ScalarType type{};
  std::optional<ScalarType> count;  // of a list: the type of its length
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties = {};
};

// Where the reader stands, and the lines of a text.
class PlyInput {
 public:
  PlyInput(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  [[noreturn]] void refuse_line(const std::string& what) const {
    throw Error(ErrorCode::io, where_ + ":" + std::to_string(line_), what);
  }
  [[noreturn]] void refuse_byte(const std::string& what) const {
    throw Error(ErrorCode::io, where_, what + ", at byte " + std::to_string(at_));
  }
  bool at_end() const { return at_ == bytes_.size(); }
  std::size_t left() const { return bytes_.size() - at_; }

  // The words of the next line, which ends in LF, CR LF or CR.
  std::vector<std::string_view> words() {
    const std::size_t end = std::min(bytes_.find_first_of("\r\n", at_), bytes_.size());
    const std::string_view line = bytes_.substr(at_, end - at_);
    at_ = std::min(end + (bytes_.substr(end, 2) == "\r\n" ? 2 : 1), bytes_.size());
    ++line_;
    std::vector<std::string_view> words;
    for (std::size_t begin, stop = 0;
         (begin = line.find_first_not_of(" \t", stop)) != std::string_view::npos;) {
      stop = std::min(line.find_first_of(" \t", begin), line.size());
      words.push_back(line.substr(begin, stop - begin));
    }
    return words;
  }
  const char* take(std::size_t count, const char* of) {
    if (count > left()) refuse_byte(std::string("the file ends within ") + of);
    at_ += count;
    return bytes_.data() + at_ - count;
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;  // the last one read
};

struct PlyHeader {
  PlyForm form = PlyForm::text;
  std::vector<PlyElement> elements;
};

ScalarType ply_type(const PlyInput& in, std::string_view word, bool big_endian) {
  using Kind = ScalarType::Kind;
  static const std::map<std::string_view, std::pair<Kind, std::size_t>> kTypes = {
      {"char", {Kind::integer, 1}},   {"int8", {Kind::integer, 1}},   {"uchar", {Kind::natural, 1}},
      {"uint8", {Kind::natural, 1}},  {"short", {Kind::integer, 2}},  {"int16", {Kind::integer, 2}},
      {"ushort", {Kind::natural, 2}}, {"uint16", {Kind::natural, 2}}, {"int", {Kind::integer, 4}},
      {"int32", {Kind::integer, 4}},  {"uint", {Kind::natural, 4}},   {"uint32", {Kind::natural, 4}},
      {"int64", {Kind::integer, 8}},  {"uint64", {Kind::natural, 8}}, {"float", {Kind::real, 4}},
      {"float32", {Kind::real, 4}},   {"double", {Kind::real, 8}},    {"float64", {Kind::real, 8}},
  };
  const auto type = kTypes.find(word);
  if (type == kTypes.end())
    in.refuse_line("'" + std::string(word) + "' is no type of PLY, as float or uchar are");
  return {type->second.first, type->second.second, big_endian};
}

using Words = std::vector<std::string_view>;

PlyForm read_form(PlyInput& in) {
  if (in.words() != Words{"ply"}) in.refuse_line("a PLY file begins with the line 'ply'");
  for (Words words = in.words();; words = in.words()) {
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
      if (in.at_end()) in.refuse_line("the PLY header has no 'end_header'");
      continue;
    }
    if (words.size() == 3 && words[0] == "format" && words[2] == "1.0") {
      if (words[1] == "ascii") return PlyForm::text;
      if (words[1] == "binary_little_endian") return PlyForm::little_endian;
      if (words[1] == "binary_big_endian") return PlyForm::big_endian;
    }
    in.refuse_line("expected 'format ascii 1.0', or binary_little_endian or binary_big_endian");
  }
}

PlyElement read_element(const PlyInput& in, const Words& words) {
  PlyElement element;
  const std::string_view count = words.size() == 3 ? words[2] : std::string_view();
  const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (count.empty() || error != std::errc{} || end != count.data() + count.size())
    in.refuse_line("expected 'element', its name and how many of it there are");
  element.name = words[1];
  return element;
}

PlyProperty read_property(const PlyInput& in, const Words& words, bool big_endian) {
  PlyProperty property;
  const bool list = words.size() > 1 && words[1] == "list";
  if (words.size() < (list ? 5u : 3u)) in.refuse_line("expected 'property', its type and its name");
  if (list) {
    property.count = ply_type(in, words[2], big_endian);
    if (property.count->kind == ScalarType::Kind::real)
      in.refuse_line("the length of a list cannot be of type '" + std::string(words[2]) + "'");
  }
  property.type = ply_type(in, words[list ? 3 : 1], big_endian);
  property.name = words[list ? 4 : 2];
  return property;
}

PlyHeader read_header(PlyInput& in) {
  PlyHeader header;
  header.form = read_form(in);
  const bool big_endian = header.form == PlyForm::big_endian;
  for (Words words = in.words(); words != Words{"end_header"}; words = in.words()) {
    if (in.at_end()) in.refuse_line("the PLY header has no 'end_header'");
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "element") {
      header.elements.push_back(read_element(in, words));
    } else if (words[0] == "property") {
      if (header.elements.empty()) in.refuse_line("a property before any element");
      header.elements.back().properties.push_back(read_property(in, words, big_endian));
    } else {
      in.refuse_line("expected element, property, comment or end_header, got '" + std::string(words[0]) +
                     "'");
    }
  }
  return header;
}

// Where the values of a property go: property k of a point is put into its place.
using Put = std::function<void(double)>;

double text_number(const PlyInput& in, std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || error == std::errc::invalid_argument)
    in.refuse_line("expected a number, got '" + std::string(word.substr(0, 40)) + "'");
  // One that no double holds.
  if (error != std::errc{}) value = std::numeric_limits<double>::infinity();
  return value;
}

// One line an element; blank ones are passed over.
void read_text_row(PlyInput& in, const PlyElement& element, const std::vector<Put>& put) {
  Words words;
  while (words.empty()) {
    if (in.at_end()) in.refuse_line("the file ends before the last '" + element.name + "'");
    words = in.words();
  }
  std::size_t next = 0;
  const auto take = [&] {
    if (next == words.size()) in.refuse_line("too few values for an element '" + element.name + "'");
    return words[next++];
  };
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    if (element.properties[k].count) {
      const double length = text_number(in, take());
      if (!(length >= 0 && length <= static_cast<double>(words.size() - next)))
        in.refuse_line("a list '" + element.properties[k].name + "' is longer than its line");
      next += static_cast<std::size_t>(length);
    } else if (put[k]) {
      put[k](text_number(in, take()));
    } else {
      take();
    }
  }
  if (next != words.size()) in.refuse_line("too many values for an element '" + element.name + "'");
}

void read_binary_row(PlyInput& in, const PlyElement& element, const std::vector<Put>& put) {
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    const PlyProperty& property = element.properties[k];
    if (property.count) {
      const double length = read_scalar(*property.count, in.take(property.count->bytes, "a list"));
      if (!(length >= 0 && length <= static_cast<double>(in.left() / property.type.bytes)))
        in.refuse_byte("a list '" + property.name + "' is longer than the file");
      in.take(static_cast<std::size_t>(length) * property.type.bytes, "a list");
    } else {
      const char* bytes = in.take(property.type.bytes, "an element");
      if (put[k]) put[k](read_scalar(property.type, bytes));
    }
  }
}

// The least bytes that one of it takes.
std::size_t least_bytes(const PlyElement& element, PlyForm form) {
  std::size_t bytes = 0;
  for (const PlyProperty& p : element.properties)
    bytes += form == PlyForm::text ? 2 : p.count ? p.count->bytes : p.type.bytes;
  return std::max<std::size_t>(bytes, 1);
}

void read_rows(PlyInput& in, const PlyElement& element, PlyForm form, const std::vector<Put>& put) {
  if (element.properties.empty()) return;
  const std::size_t without_end = form == PlyForm::text ? 1 : 0;  // of the last line
  if (element.count > (in.left() + without_end) / least_bytes(element, form))
    in.refuse_byte("the header promises " + std::to_string(element.count) + " elements '" + element.name +
                   "', but the file is too short for them");
  for (std::size_t i = 0; i < element.count; ++i)
    form == PlyForm::text ? read_text_row(in, element, put) : read_binary_row(in, element, put);
}

std::string bare_name(const std::string& name) {
  constexpr std::string_view kPrefix = "scalar_";  // of CloudCompare
  return name.starts_with(kPrefix) ? name.substr(kPrefix.size()) : name;
}

class VertexReader {
 public:
  VertexReader(const PlyInput& in, const PlyElement& element) : in_(in), element_(element) {
    put_.resize(element.properties.size());
    const bool placed = take_vector({{"x", "y", "z"}}, cloud_.position);
    if (!placed) in.refuse_byte("the element 'vertex' lacks the properties x, y and z");
    for (const auto& names : kVelocities) {
      if (take_vector(names, cloud_.velocity)) break;
    }
    take_number({"volume"}, cloud_.volume);
    take_number({"mass"}, cloud_.mass);
    take_number({"radius", "pscale"}, cloud_.radius);
    take_number({"density"}, cloud_.density);
    take_number({"Jp"}, cloud_.packing);
  }

  PointCloud read(PlyInput& in, PlyForm form) {
    read_rows(in, element_, form, put_);
    return std::move(cloud_);
  }

 private:
  using Names = std::array<const char*, 3>;
  static constexpr std::array<Names, 2> kVelocities = {
      {{"vx", "vy", "vz"}, {"velocity_x", "velocity_y", "velocity_z"}}};

  std::optional<std::size_t> find(std::string_view name) const {
    std::optional<std::size_t> found;
    for (std::size_t k = 0; k < element_.properties.size(); ++k) {
      const PlyProperty& property = element_.properties[k];
      if (property.count || bare_name(property.name) != name) continue;
      if (found) in_.refuse_byte("the element 'vertex' has two properties '" + std::string(name) + "'");
      found = k;
    }
    return found;
  }

  // The first component makes the row that the others fill: each in its own column until then.
  bool take_vector(const Names& names, std::vector<Vec3>& column) {
    std::array<std::optional<std::size_t>, 3> at;
    for (int axis = 0; axis < 3; ++axis) at[axis] = find(names[axis]);
    if (!at[0] && !at[1] && !at[2]) return false;
    const std::size_t first = std::min({at[0].value_or(0), at[1].value_or(0), at[2].value_or(0)});
    for (int axis = 0; axis < 3; ++axis) {
      if (!at[axis]) in_.refuse_byte(std::string("the element 'vertex' lacks the property ") + names[axis]);
      put_[*at[axis]] = [&column, axis, begins = *at[axis] == first](double value) {
        if (begins) column.emplace_back(Vec3::Zero());
        column.back()[axis] = value;
      };
    }
    return true;
  }

  void take_number(const std::vector<const char*>& names, std::vector<double>& column) {
    for (const char* name : names) {
      const auto at = find(name);
      if (!at) continue;
      put_[*at] = [&column](double value) { column.push_back(value); };
      return;
    }
  }

  const PlyInput& in_;
  const PlyElement& element_;
  PointCloud cloud_;
  std::vector<Put> put_;
};

}  // namespace

PointCloud decode_ply(std::string_view bytes, const std::string& where) {
  PlyInput in(bytes, where);
  const PlyHeader header = read_header(in);
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") return VertexReader(in, element).read(in, header.form);
    read_rows(in, element, header.form, std::vector<Put>(element.properties.size()));
  }
  in.refuse_byte("the PLY file has no element 'vertex'");
}

}  // namespace firn
