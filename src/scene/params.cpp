// SPDX-License-Identifier: MIT
// The schema for people: `firn params` and docs/scene_format.md.
#include <ostream>
#include <sstream>

#include "firn/error.h"
#include "src/core/text.h"
#include "src/scene/presets.h"
#include "src/scene/scene.h"
#include "src/scene/schema.h"
#include "src/scene/suggest.h"

namespace firn {
namespace {

std::string full_name(const TableSpec& table, const KeySpec& key) {
  return table.name.empty() ? key.name : table.name + "." + key.name;
}

std::string allowed(const KeySpec& key) { return key.notes.range.everything() ? "" : key.notes.range.text(); }

std::string condition(const KeySpec& key) {
  const Condition& with = key.notes.with;
  if (with.key.empty()) return "";
  std::string values;
  for (const std::string& value : with.values) values += (values.empty() ? "" : ", ") + value;
  return with.key + " = " + values;
}

void print_key(std::ostream& out, const TableSpec& table, const KeySpec& key) {
  out << full_name(table, key) << "\n    " << type_text(key);
  if (*key.notes.unit) out << " [" << key.notes.unit << "]";
  out << "; default: " << default_text(table, key);
  if (!allowed(key).empty()) out << "; range: " << allowed(key);
  if (!condition(key).empty()) out << "; for " << condition(key);
  out << "\n    " << key.notes.meaning << "\n";
}

void print_table_rows(std::ostream& out, const TableSpec& table) {
  out << "| key | type | unit | default | range | for | meaning |\n|---|---|---|---|---|---|---|\n";
  for (const KeySpec& key : table.keys) {
    out << "| `" << key.name << "` | " << type_text(key) << " | " << key.notes.unit << " | "
        << default_text(table, key) << " | " << allowed(key) << " | " << condition(key) << " | "
        << key.notes.meaning << " |\n";
  }
}

const char* const kIntroduction = R"(# The scene format

Generated from the schema table in `src/scene` (`firn params` prints the same). Do not edit by hand.

A scene is a TOML file. Units are SI, the world is right-handed with +Y up, colours are linear RGB: one number or three.
An unknown key, a value of the wrong type or out of its range, and a contradiction end with one line that says where:
`scene.toml:12:3: unknown key 'raduis' in [[snow]], did you mean 'radius'?`

```toml
[camera]
position = [0.0, 0.3, 1.5]
target = [0.0, 0.15, 0.0]

[simulation]
particles_across = 24

[[snow]]
shape = "ball"
center = [0.0, 0.3, 0.0]
radius = 0.1

[ground]
```

## Changing values
`--set snow.young_modulus=2e5` changes every `[[snow]]`, `--set snow[0].radius=0.1` one by its number, counted from 0,
`--set snow.left.radius=0.1` one by its name, `--set image.width=320` a table that is written once. A `[quick]` table
holds the values of the scene's small size (`--quick`) under the same paths: `[quick.image]`, `[quick.snow]` for every
snow, `[quick.snow.left]` for one. `--set` comes after `[quick]`. Setting `dx` takes `particles_across` out, and the other
way round.
)";

void print_presets(std::ostream& out) {
  out << "\n## Snow presets\nKeys that are written beat the preset.\n\n"
         "| preset | density kg/m^3 | grain_radius m | young_modulus Pa | critical_compression | "
         "critical_stretch | hardening "
         "| meaning | "
         "source |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Preset& preset : presets()) {
    const Material& m = preset.material;
    out << "| `" << preset.name << "` | " << m.density << " | " << preset.grain_radius << " | "
        << m.young_modulus << " | " << m.critical_compression << " | " << m.critical_stretch << " | "
        << m.hardening << " | " << preset.meaning << " | " << preset.source << " |\n";
  }
}

// Prints the keys of which `wanted(name, key)` is true; whether there were any.
template <class Wanted>
bool print_keys(std::ostream& out, const Wanted& wanted) {
  bool any = false;
  for (const TableSpec& table : schema()) {
    for (const KeySpec& key : table.keys) {
      if (!wanted(full_name(table, key), key)) continue;
      print_key(out, table, key);
      any = true;
    }
  }
  return any;
}

// With and without their tables, as people type them.
std::vector<std::string> all_names() {
  std::vector<std::string> names;
  for (const TableSpec& table : schema()) {
    for (const KeySpec& key : table.keys) names.insert(names.end(), {full_name(table, key), key.name});
  }
  return names;
}

}  // namespace

void print_params(std::ostream& out, const std::string& word) {
  const auto begins = [&](const std::string& name, const KeySpec&) { return name.starts_with(word); };
  const auto tells = [&](const std::string& name, const KeySpec& key) {
    return lower_case(name).find(lower_case(word)) != std::string::npos ||
           lower_case(key.notes.meaning).find(lower_case(word)) != std::string::npos;
  };
  if (print_keys(out, begins) || print_keys(out, tells)) return;
  throw Error(ErrorCode::usage, "",
              "no key of a scene has '" + word + "' in its name or meaning" + suggestion(word, all_names()));
}

std::string scene_format_markdown() {
  std::ostringstream out;
  out << kIntroduction;
  for (const TableSpec& table : schema()) {
    out << "\n## " << (table.name.empty() ? "Top level" : table.heading()) << "\n"
        << table.meaning << (table.repeated ? "; any number of times" : "") << "\n\n";
    print_table_rows(out, table);
  }
  print_presets(out);
  return out.str();
}

}  // namespace firn
