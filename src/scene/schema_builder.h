// SPDX-License-Identifier: MIT
// Turns a member of a record into the type-erased accessors of a KeySpec: `table.key("fov", &Camera::fov,
// {...})`.
#pragma once
#include <algorithm>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "src/scene/schema.h"

namespace firn {

template <class T>
struct OptionalOf {
  static constexpr bool value = false;
  using type = T;
};
template <class T>
struct OptionalOf<std::optional<T>> {
  static constexpr bool value = true;
  using type = T;
};

template <class T>
constexpr ValueType value_type() {
  if constexpr (std::is_same_v<T, bool>) return ValueType::boolean;
  if constexpr (std::is_enum_v<T> || std::is_same_v<T, std::string>) return ValueType::text;
  if constexpr (std::is_integral_v<T>) return ValueType::integer;
  if constexpr (std::is_floating_point_v<T>) return ValueType::number;
  if constexpr (std::is_same_v<T, Vec3>) return ValueType::vector;
  if constexpr (std::is_same_v<T, Vec3f>) return ValueType::color;
  if constexpr (std::is_same_v<T, std::vector<KeyFrameConfig>>) return ValueType::key_frames;
  if constexpr (std::is_same_v<T, std::vector<CameraKey>>) return ValueType::camera_keys;
  return ValueType::list;
}

// Enumerators are stored as their index among the choices.
template <class T>
T from_value(const KeyValue& value, const std::vector<std::string>& choices) {
  if constexpr (std::is_enum_v<T>) {
    const auto at = std::find(choices.begin(), choices.end(), std::get<std::string>(value));
    return static_cast<T>(at - choices.begin());
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    return static_cast<T>(std::get<std::int64_t>(value));
  } else if constexpr (std::is_same_v<T, Vec3f>) {
    return std::get<Vec3>(value).template cast<float>();
  } else {
    return std::get<T>(value);
  }
}

template <class T>
KeyValue to_value(const T& field, const std::vector<std::string>& choices) {
  if constexpr (std::is_enum_v<T>) {
    return choices[static_cast<std::size_t>(field)];
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    return static_cast<std::int64_t>(field);
  } else if constexpr (std::is_same_v<T, Vec3f>) {
    return Vec3(field.template cast<double>());
  } else {
    return field;
  }
}

template <class Record>
class TableBuilder {
 public:
  using At = Record& (*)(SceneConfig&, std::size_t);

  TableBuilder(TableSpec spec, At at) : spec_(std::move(spec)), at_(at) {}

  // `member` is a pointer to a member or a function from a Record& to a reference.
  template <class Member>
  KeySpec& key(const char* name, Member member, KeyNotes notes) {
    using Field = std::remove_cvref_t<std::invoke_result_t<Member, Record&>>;
    using T = typename OptionalOf<Field>::type;
    const auto field = [at = at_, member](SceneConfig& scene, std::size_t index) -> Field& {
      return std::invoke(member, at(scene, index));
    };
    const std::vector<std::string> choices = notes.choices;
    KeySpec key{name, value_type<T>(), std::move(notes), {}, {}};
    key.set = [field, choices](SceneConfig& scene, std::size_t index, const KeyValue& value) {
      field(scene, index) = from_value<T>(value, choices);
    };
    key.get = [field, choices](const SceneConfig& scene, std::size_t index) -> std::optional<KeyValue> {
      const Field& value = field(const_cast<SceneConfig&>(scene), index);
      if constexpr (OptionalOf<Field>::value) {
        if (!value) return std::nullopt;
        return to_value<T>(*value, choices);
      } else {
        return to_value<T>(value, choices);
      }
    };
    spec_.keys.push_back(std::move(key));
    return spec_.keys.back();
  }

  TableSpec take() { return std::move(spec_); }

 private:
  TableSpec spec_;
  At at_;
};

// A table that is written once and always there.
template <class Record>
TableBuilder<Record> single_table(const char* name, const char* meaning,
                                  Record& (*at)(SceneConfig&, std::size_t)) {
  return {{name, false, meaning, {}, [](const SceneConfig&) { return std::size_t{1}; }, [](SceneConfig&) {}},
          at};
}

// A table that is written any number of times and kept in a vector.
template <auto list>
auto repeated_table(const char* name, const char* meaning) {
  using List = std::remove_cvref_t<decltype(std::declval<SceneConfig&>().*list)>;
  return TableBuilder<typename List::value_type>(
      {name,
       true,
       meaning,
       {},
       [](const SceneConfig& scene) { return (scene.*list).size(); },
       [](SceneConfig& scene) { (scene.*list).emplace_back(); }},
      [](SceneConfig& scene, std::size_t index) ->
      typename List::value_type& { return (scene.*list)[index]; });
}

}  // namespace firn
