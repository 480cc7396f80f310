// SPDX-License-Identifier: MIT
// The only file that knows the JSON library. Each struct is written and read by one list of its fields.
#include "src/io/manifest.h"

#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/journal.h"

namespace firn {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostFrames = 10'000'000;

// Visits every field of a record by name; the same list serves writing (F stores) and reading (F loads).
template <class M, class F>
void metrics_fields(M& m, F&& field) {
  field("time_s", m.time);
  field("steps", m.steps);
  field("particle_steps", m.particle_steps);
  field("particles", m.particles);
  field("particles_left", m.particles_left);
  field("particles_asleep", m.particles_asleep);
  field("mass_kg", m.mass);
  field("momentum_kg_m_s", m.momentum);
  field("angular_momentum_kg_m2_s", m.angular_momentum);
  field("kinetic_energy_J", m.kinetic_energy);
  field("elastic_energy_J", m.elastic_energy);
  field("potential_energy_J", m.potential_energy);
  field("plastic_work_J", m.plastic_work);
  field("volume_m3", m.volume);
  field("density_p05_kg_m3", m.density_p05);
  field("density_p50_kg_m3", m.density_p50);
  field("density_p95_kg_m3", m.density_p95);
  field("front_m", m.front);
  field("max_speed_m_s", m.max_speed);
  field("bounds_min_m", m.bounds_min);
  field("bounds_max_m", m.bounds_max);
  field("dt_s", m.step.dt);
  field("dt_cause", m.step.cause);
  field("contact_force_N", m.contacts);
}

template <class R, class F>
void frame_fields(R& r, F&& field) {
  field("frame", r.frame);
  field("simulate_s", r.simulate_seconds);
  field("trace_s", r.trace_seconds);
  field("choice_s", r.choice_seconds);
  field("write_s", r.write_seconds);
  field("rays", r.rays);
  field("samples_per_pixel", r.mean_samples);
  field("snow_mass_kg", r.snow_mass);
  field("medium_mass_kg", r.medium_mass);
  field("integrator", r.integrator);
  field("particle_steps", r.particle_steps);
  field("metrics", r.metrics);
  field("particles_hash", r.particles_hash);
  field("picture_hash", r.picture_hash);
  field("files", r.files);
}

template <class M, class F>
void manifest_fields(M& m, F&& field) {
  field("status", m.status);
  field("error", m.error);
  field("command", m.command);
  field("version", m.version);
  field("revision", m.revision);
  field("compiler", m.compiler);
  field("build_type", m.build_type);
  field("cpu", m.cpu);
  field("isa", m.isa);
  field("threads", m.threads);
  field("slots", m.slots);
  field("force", m.force);
  field("seed", m.seed);
  field("started", m.started);
  field("id", m.id);
  field("wall_s", m.wall_seconds);
  field("first_frame", m.first);
  field("last_frame", m.last);
  field("pictures", m.pictures);
  field("particles", m.particles);
  field("wants_movie", m.wants_movie);
  field("bytes_per_particle", m.bytes_per_particle);
  field("movie", m.movie);
  field("movie_hash", m.movie_hash);
  field("inputs", m.inputs);
  field("driven", m.driven);
  field("snow_from", m.snow_from);
  field("snow_origin", m.snow_origin);
  field("scene_file", m.scene_file);
  field("scene_hash", m.scene_hash);
  field("scene", m.scene);
}

struct Store {
  Json& json;
  template <class T>
  void operator()(const char* name, const T& value) const {
    json[name] = value;
  }
  void operator()(const char* name, const Vector3& v) const { json[name] = v; }
  // Only where there are any.
  void operator()(const char* name, const std::vector<std::string>& names) const {
    if (!names.empty()) json[name] = names;
  }
  void operator()(const char* name, const Metrics& m) const {
    metrics_fields(m, Store{json[name] = Json::object()});
  }
  void operator()(const char* name, const std::vector<ContactForce>& contacts) const {
    Json& list = json[name] = Json::array();
    for (const ContactForce& contact : contacts) {
      const Store to{list.emplace_back(Json::object())};
      to("collider", contact.collider);
      to("force", contact.force);
      to("torque", contact.torque);
    }
  }
  void operator()(const char* name, const std::vector<std::pair<std::string, std::string>>& files) const {
    Json& map = json[name] = Json::object();
    for (const auto& [file, hash] : files) map[file] = hash;
  }
};

struct Load {
  const Json& json;

  // The library converts any number, also one that T does not hold. Errors: std::out_of_range.
  template <class T>
  T whole_number(const char* name) const {
    const Json& number = json.at(name);
    const auto get = [&](auto value) -> T {
      if (std::in_range<T>(value)) return static_cast<T>(value);
      throw std::out_of_range(name + (": " + std::to_string(value)) + " is out of range");
    };
    if (number.is_number_unsigned()) return get(number.get<std::uint64_t>());
    if (number.is_number_integer()) return get(number.get<std::int64_t>());
    throw std::out_of_range(std::string(name) + " is not a whole number");
  }
  template <class T>
  void operator()(const char* name, T& value) const {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>)
      value = whole_number<T>(name);
    else
      json.at(name).get_to(value);
  }
  // JSON has no NaN: it was written as null. What an earlier version did not measure is 0.
  void operator()(const char* name, double& value) const {
    const auto found = json.find(name);
    value = found == json.end() || found->is_null() ? 0.0 : found->get<double>();
  }
  void operator()(const char* name, Vector3& v) const {
    for (std::size_t axis = 0; axis < 3; ++axis) v[axis] = json.at(name).at(axis).get<double>();
  }
  void operator()(const char* name, std::vector<std::string>& names) const {
    if (json.contains(name)) json.at(name).get_to(names);
  }
  void operator()(const char* name, Metrics& m) const { metrics_fields(m, Load{json.at(name)}); }
  void operator()(const char* name, std::vector<ContactForce>& contacts) const {
    for (const auto& item : json.at(name)) {
      ContactForce& contact = contacts.emplace_back();
      const Load from{item};
      from("collider", contact.collider);
      from("force", contact.force);
      if (item.contains("torque")) from("torque", contact.torque);
    }
  }
  void operator()(const char* name, std::vector<std::pair<std::string, std::string>>& files) const {
    for (const auto& [file, hash] : json.at(name).items())
      files.emplace_back(file, hash.template get<std::string>());
  }
};

// Calls `read`; what does not fit is an Error at `where` that begins with `what`.
template <class F>
void read_fields(const std::string& where, const std::string& what, F&& read) {
  try {
    read();
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorCode::io, where, what + ": " + error.what());
  } catch (const std::out_of_range& error) {
    throw Error(ErrorCode::io, where, what + ": " + error.what());
  }
}

// The hash is the last field, and is of all text before it. Version 0.1 wrote none.
constexpr std::string_view kHashKey = ",\n \"hash\": \"", kEnd = "\n}";

// All fields, but not the end, after which others may follow.
std::string text_of(const Manifest& manifest) {
  Json json = Json::object();
  manifest_fields(manifest, Store{json});
  std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace);
  text.resize(text.size() - kEnd.size());
  return text;
}

// As version 0.1 kept them.
std::vector<FrameRecord> early_frames(Json& list) {
  std::vector<FrameRecord> frames;
  for (Json& item : list) {
    if (item.contains("film_hash")) item["picture_hash"] = item["film_hash"];
    frame_fields(frames.emplace_back(), Load{item});
  }
  return frames;
}

void check_hash(const std::string& text, const std::string& where) {
  const std::size_t at = text.rfind(kHashKey);
  if (at == std::string::npos ||
      text.compare(at + kHashKey.size(), 16, hash_in_hex(std::string_view(text).substr(0, at))) != 0)
    throw Error(ErrorCode::io, where, "damaged manifest: it is not as firn wrote it");
}

// What no writer of a manifest leaves behind.
void check(const Manifest& m, const std::string& where) {
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorCode::io, where, "damaged manifest: " + what);
  };
  if (m.first < 0 || m.last < m.first || m.last > kMostFrames)
    fail("its frames are " + std::to_string(m.first) + "-" + std::to_string(m.last));
  if (hash_in_hex(m.scene) != m.scene_hash) fail("its scene is not the one that the run began with");
  int before = m.first - 1;
  for (const FrameRecord& record : m.frames) {
    if (record.frame <= before || record.frame > m.last)
      fail("it has a frame " + std::to_string(record.frame) + " out of order");
    before = record.frame;
  }
}

}  // namespace

void write_manifest(const std::filesystem::path& path, const Manifest& manifest) {
  std::string text = text_of(manifest);
  const std::string hash = hash_in_hex(text);
  text.append(kHashKey).append(hash).append("\"").append(kEnd);
  write_file(path, text + "\n");
}

Manifest read_manifest(const std::filesystem::path& path, const std::filesystem::path& journal) {
  Manifest manifest;
  const std::string text = read_file(path);
  bool has_frames = false;
  read_fields(path.string(), "not a manifest that this version of firn reads", [&] {
    Json json = Json::parse(text);
    // What version 0.1 did not write.
    json.emplace("inputs", Json::object());
    for (const char* key : {"movie_hash", "id", "snow_origin"}) json.emplace(key, "");
    manifest_fields(manifest, Load{json});
    has_frames = json.contains("frames");
    if (has_frames) manifest.frames = early_frames(json.at("frames"));
  });
  if (!manifest.version.starts_with("0.1.")) check_hash(text, path.string());
  if (!has_frames) manifest.frames = read_journal(journal, manifest.key());
  check(manifest, path.string());
  return manifest;
}

void print_manifest(std::ostream& out, const Manifest& manifest) {
  out << text_of(manifest) << ",\n \"frames\": [";
  const char* before = "\n  ";
  for (const FrameRecord& record : manifest.frames) {
    out << before << encode_record(record);
    before = ",\n  ";
  }
  out << "\n ]" << kEnd << "\n";
}

std::string encode_record(const FrameRecord& record) {
  Json json = Json::object();
  frame_fields(record, Store{json});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

FrameRecord decode_record(std::string_view text, const std::string& where) {
  FrameRecord record;
  read_fields(where, "not the record of a frame", [&] {
    const Json json = Json::parse(text);
    frame_fields(record, Load{json});
  });
  return record;
}

}  // namespace firn
