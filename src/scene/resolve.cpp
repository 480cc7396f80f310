// SPDX-License-Identifier: MIT
// In: a SceneConfig. Out: TOML with every key that has a meaning in it written out.
#include <sstream>

#include "src/scene/scene.h"
#include "src/scene/schema.h"

namespace firn {
namespace {

bool is_empty_text(const KeyValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text && text->empty();
}

void write_record(std::ostream& out, const TableSpec& table, const SceneConfig& scene, std::size_t index) {
  if (!table.name.empty()) out << "\n" << table.heading() << "\n";
  for (const KeySpec& key : table.keys) {
    const auto value = key.get(scene, index);
    if (!value || is_empty_text(*value) || !applies(table, key, scene, index)) continue;
    out << key.name << " = " << value_toml(*value, key.type) << "\n";
  }
}

}  // namespace

std::string resolved_toml(const SceneConfig& scene) {
  std::ostringstream out;
  for (const TableSpec& table : schema()) {
    for (std::size_t i = 0; i < table.count(scene); ++i) write_record(out, table, scene, i);
  }
  return out.str();
}

}  // namespace firn
