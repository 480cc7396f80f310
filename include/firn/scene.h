// SPDX-License-Identifier: MIT
// A scene: read from a file, made in code, or both. Its tables and keys are those of scene files, so that
// what docs/scene_format.md and `firn params` say of a key holds here too, and a value meets the same checks
// wherever it comes from.
#pragma once
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "firn/error.h"
#include "firn/export.h"
#include "firn/points.h"

namespace firn {

struct PointCloud;
struct SceneConfig;
struct Key;

// Keys with their values, as between two headings of a scene file. A key is given once.
using Table = std::vector<Key>;

// What a key may have as its value: true or false, a number, a text, or an array of these or of tables. A
// vector is an array of three numbers.
class FIRN_API Value {
 public:
  // Values in their order.
  using Array = std::vector<Value>;

  // As it is written.
  Value(bool value);
  // Errors: usage Error beyond 64 bits with a sign.
  template <std::integral Integer>
  Value(Integer value);
  // As it is written. Numbers, texts and tables in braces are an array.
  Value(double value);
  Value(const char* text);
  Value(std::string text);
  Value(Array values);
  Value(Table keys);
  Value(std::initializer_list<double> numbers);
  Value(std::initializer_list<std::string> texts);
  Value(std::initializer_list<Table> tables);

  // What it may be.
  using Variant = std::variant<bool, std::int64_t, double, std::string, Array, Table>;
  // What it is.
  const Variant& variant() const { return value_; }

 private:
  struct Whole {
    std::int64_t value;
  };
  explicit Value(Whole whole);
  template <std::integral Integer>
  static std::int64_t checked(Integer value) {
    if (!std::in_range<std::int64_t>(value)) throw too_large();
    return static_cast<std::int64_t>(value);
  }
  static Error too_large();

  Variant value_;
};

// A line of a scene file.
struct Key {
  std::string name;  // as docs/scene_format.md has it
  Value value;       // checked when the scene is
};

template <std::integral Integer>
Value::Value(Integer value) : Value(Whole{checked(value)}) {}

// Where something was said, in any words, for error messages. Where none is given it is the line of the
// program.
struct Place {
  std::string words;  // before the colon of a message
};

// One value as the command line's `--set path=value` has it: the value is TOML; a bare word is a text.
struct SceneOverride {
  std::string path;   // as in Scene::set
  std::string value;  // TOML, or a bare word
};

// What is changed of a scene file while it is read.
struct ReadOptions {
  bool quick = false;                         // the small size: the values of the scene's [quick] table
  std::vector<SceneOverride> overrides = {};  // after [quick]
};

// A value: copies are independent. One object must not be changed while another thread uses it.
class FIRN_API Scene {
 public:
  // Without snow or anything else, which add() and set() bring.
  explicit Scene(const std::string& name = "scene", const char* file = __builtin_FILE(),
                 int line = __builtin_LINE());
  Scene(const std::string& name, const Place& place);
  Scene(const Scene&);
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene) noexcept;
  ~Scene();

  // Errors: usage Error "scene.toml:12:3: ..." for syntax, an unknown key (with the nearest known one), a
  // wrong type, a value out of range, a contradiction; io Error when a file cannot be read. "-" is the
  // standard input.
  static Scene read(const std::string& file, const ReadOptions& options = {});
  // `file` is what errors call the text; paths in it are relative to that file's folder.
  static Scene parse(const std::string& text, const std::string& file = "scene",
                     const ReadOptions& options = {});

  // "image.width"; "snow.radius" (of every [[snow]]), "snow[0].radius", "snow.left.radius" (by name). Errors:
  // usage Error at once for a path that leads nowhere; what is wrong with the value comes out of check().
  Scene& set(const std::string& path, const Value& value, const Place& place);
  Scene& set(const std::string& path, const Value& value, const char* file = __builtin_FILE(),
             int line = __builtin_LINE());
  // One more table of a list: add("snow", {{"shape", "ball"}, {"radius", 0.1}, {"center", {0, 1, 0}}}).
  // Errors: usage Error at once for an unknown list or a key that is given twice.
  Scene& add(const std::string& list, const Table& keys, const Place& place);
  Scene& add(const std::string& list, const Table& keys, const char* file = __builtin_FILE(),
             int line = __builtin_LINE());

  // One more [[snow]] of shape "particles", made of arrays in the place of a file; `keys` are its other keys.
  // Such a scene is for simulations and renderers; the run folder of a session needs a file (write_points).
  // Errors: usage Error at once, as add(), and for points that firn cannot take.
  Scene& add_points(const Points& points, const Table& keys, const Place& place);
  Scene& add_points(const Points& points, const Table& keys = {}, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE());

  // Errors: as read(), for everything that was said up to now. Whatever uses the scene checks it too.
  void check() const;
  // With every default written out, as TOML that parse() reads back to the same scene. Errors: as check().
  std::string toml() const;
  // As many as 'time.frames' says. Errors: as check().
  int frames() const;
  double frame_time(int frame) const;  // s, of the simulation

 private:
  struct State;
  explicit Scene(State state);
  friend SceneConfig config_of(const Scene& scene);
  friend Scene scene_with(Scene scene, std::vector<std::shared_ptr<const PointCloud>> arrays);

  std::unique_ptr<State> state_;
};

}  // namespace firn
