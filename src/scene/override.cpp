// SPDX-License-Identifier: MIT
// In: "snow.left.radius" and a value. Out: the tree with the value in every record that the path names.
#include "src/scene/override.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "firn/error.h"
#include "src/scene/schema.h"
#include "src/scene/suggest.h"

namespace firn {
namespace {

struct Change {
  std::vector<std::string> path;
  std::string where;
  RawValue value;
};

[[noreturn]] void refuse(const Change& change, const std::string& what) {
  throw Error(ErrorCode::usage, change.where, what);
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts(1);
  for (char c : path) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// "snow[2]" -> "snow" and 2.
std::optional<std::size_t> take_index(std::string& part) {
  const auto open = part.find('[');
  if (open == std::string::npos || part.back() != ']') return std::nullopt;
  std::size_t index = 0;
  const char* end = part.data() + part.size() - 1;
  const auto read = std::from_chars(part.data() + open + 1, end, index);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  part.erase(open);
  return index;
}

std::string record_name(const RawTable& record, const std::string& table, std::size_t index) {
  const RawValue* name = record.find("name");
  const auto* text = name ? std::get_if<std::string>(&name->value) : nullptr;
  return text ? *text : table + std::to_string(index);
}

// Keys that say the same thing in two ways: the newer word counts.
void replace_key(RawTable& record, const std::string& table, const std::string& key, const Change& change) {
  if (table == "simulation" && key == "dx") record.erase("particles_across");
  if (table == "simulation" && key == "particles_across") record.erase("dx");
  record.set(key, change.where, change.value);
}

RawArray& records_of(RawTable& root, const std::string& table, const Change& change) {
  RawValue* value = root.find(table);
  if (!value || !value->array() || value->array()->empty())
    refuse(change, "the scene has no [[" + table + "]]");
  for (const RawValue& item : *value->array()) {
    if (!item.table()) refuse(change, "'" + table + "' is a list of tables: write [[" + table + "]]");
  }
  return *value->array();
}

void change_named(RawArray& records, const std::string& table, const Change& change) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < records.size(); ++i) {
    names.push_back(record_name(*records[i].table(), table, i));
    if (names.back() == change.path[1])
      return replace_key(*records[i].table(), table, change.path[2], change);
  }
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  refuse(change, "no [[" + table + "]] is named '" + change.path[1] + "'; there are: " + known);
}

void change_repeated(RawTable& root, const std::string& table, std::optional<std::size_t> index,
                     const Change& change) {
  RawArray& records = records_of(root, table, change);
  const std::size_t length = change.path.size();
  if (length < 2 || length > 3 || (index && length != 2)) {
    refuse(change, "expected " + table + ".KEY, " + table + "[0].KEY or " + table + ".NAME.KEY");
  }
  if (length == 3) return change_named(records, table, change);
  if (index && *index >= records.size()) {
    refuse(change,
           "the scene has only " + std::to_string(records.size()) + " [[" + table + "]], counted from 0");
  }
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!index || *index == i) replace_key(*records[i].table(), table, change.path[1], change);
  }
}

void change_single(RawTable& root, const std::string& table, const Change& change) {
  if (change.path.size() != 2) refuse(change, "expected " + table + ".KEY: each key is set by itself");
  RawValue* value = root.find(table);
  if (!value) value = &root.set(table, change.where, RawValue{RawTable{}, change.where});
  if (!value->table()) refuse(change, "'" + table + "' is a table: write [" + table + "]");
  replace_key(*value->table(), table, change.path[1], change);
}

void apply(RawTable& root, const Change& change) {
  std::string first = change.path.front();
  const auto index = take_index(first);
  const TableSpec* table = find_table(first);
  if (index && (!table || !table->repeated))
    refuse(change, "'" + first + "' stands in a scene once and has no number");
  if (find_table("")->find(first) && change.path.size() == 1) return replace_key(root, "", first, change);
  if (!table || first.empty()) {
    std::vector<std::string> names;
    for (const TableSpec& known : schema()) names.push_back(known.name);
    refuse(change, "unknown table '" + first + "'" + suggestion(first, names));
  }
  if (table->repeated) return change_repeated(root, first, index, change);
  change_single(root, first, change);
}

// The leaves of [quick], with their paths.
void collect(const RawTable& table, std::vector<std::string> path, std::vector<Change>& changes) {
  for (const RawEntry& entry : table.entries) {
    path.push_back(entry.key);
    if (entry.value.table()) {
      collect(*entry.value.table(), path, changes);
    } else {
      changes.push_back({path, entry.where, entry.value});
    }
    path.pop_back();
  }
}

}  // namespace

void apply_quick(RawTable& root) {
  const RawValue* quick = root.find("quick");
  if (!quick) return;
  if (!quick->table())
    throw Error(ErrorCode::usage, quick->where, "'quick' is a table: write [quick.image] and so on");
  std::vector<Change> changes;
  collect(*quick->table(), {}, changes);
  // What is said of one record by its name beats what is said of all.
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Change& a, const Change& b) { return a.path.size() < b.path.size(); });
  root.erase("quick");
  for (const Change& change : changes) apply(root, change);
}

void apply_override(RawTable& root, const SceneOverride& change) {
  const std::string where = "--set " + change.path;
  set_value(root, change.path, parse_toml_value(change.value, where));
}

void set_value(RawTable& root, const std::string& path, const RawValue& value) {
  apply(root, {split(path), value.where, value});
}

void add_table(RawTable& root, const std::string& list, RawValue table) {
  const TableSpec* spec = find_table(list);
  if (list.empty() || !spec || !spec->repeated) {
    std::vector<std::string> names;
    for (const TableSpec& known : schema()) {
      if (known.repeated) names.push_back(known.name);
    }
    throw Error(ErrorCode::usage, table.where,
                (spec && !list.empty() ? "'" + list + "' stands in a scene once: set its keys"
                                       : "unknown list '" + list + "'" + suggestion(list, names)));
  }
  RawValue* records = root.find(list);
  if (!records) records = &root.set(list, table.where, RawValue{RawArray{}, table.where});
  if (!records->array()) {
    throw Error(ErrorCode::usage, records->where,
                "'" + list + "' is a list of tables: write [[" + list + "]]");
  }
  records->array()->push_back(std::move(table));
}

}  // namespace firn
