// SPDX-License-Identifier: MIT
// Numbers are written with 17 significant digits: they read back to the same double.
#include "src/io/metrics_csv.h"

#include <sstream>

#include "firn/error.h"
#include "src/io/file.h"

namespace firn {
namespace {

constexpr const char* kHeader =
    "frame,time_s,steps,particle_steps,particles,particles_left,particles_asleep,mass_kg,momentum_x_kg_m_s,"
    "momentum_y_kg_m_s,"
    "momentum_z_kg_m_s,angular_momentum_x_kg_m2_s,angular_momentum_y_kg_m2_s,angular_momentum_z_kg_m2_s,"
    "kinetic_energy_J,elastic_energy_J,potential_energy_J,plastic_work_J,volume_m3,density_p05_kg_m3,density_"
    "p50_kg_m3,"
    "density_p95_kg_m3,front_m,max_speed_m_s,min_x_m,min_y_m,min_z_m,"
    "max_x_m,"
    "max_y_m,max_z_m,dt_s,dt_cause";

// In quotes where a comma or a quote would be read as the table's.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string header_of(const Metrics& metrics) {
  std::string header = kHeader;
  for (const ContactForce& contact : metrics.contacts) {
    for (const char* axis : {"x", "y", "z"}) {
      header += ',';
      header += field(std::string("force_") + axis + "_N[" + contact.collider + "]");
    }
  }
  return header + "\n";
}

void put_vector(std::ostream& out, const Vector3& v) { out << ',' << v[0] << ',' << v[1] << ',' << v[2]; }

std::string row_of(int frame, const Metrics& m) {
  std::ostringstream row;
  row.precision(17);
  row << frame << ',' << m.time << ',' << m.steps << ',' << m.particle_steps << ',' << m.particles << ','
      << m.particles_left << ',' << m.particles_asleep << ',' << m.mass;
  put_vector(row, m.momentum);
  put_vector(row, m.angular_momentum);
  row << ',' << m.kinetic_energy << ',' << m.elastic_energy << ',' << m.potential_energy << ','
      << m.plastic_work << ',' << m.volume << ',' << m.density_p05 << ',' << m.density_p50 << ','
      << m.density_p95 << ',' << m.front << ',' << m.max_speed;
  put_vector(row, m.bounds_min);
  put_vector(row, m.bounds_max);
  row << ',' << m.step.dt << ',' << field(m.step.cause);
  for (const ContactForce& contact : m.contacts) put_vector(row, contact.force);
  row << '\n';
  return row.str();
}

}  // namespace

void MetricsCsv::replace(const std::vector<FrameRecord>& frames) {
  out_.close();
  if (frames.empty()) return;
  std::string table = header_of(frames.front().metrics);
  for (const FrameRecord& record : frames) table += row_of(record.frame, record.metrics);
  write_file(path_, table);
  out_.open(path_, std::ios::app);
}

void MetricsCsv::add(int frame, const Metrics& metrics) {
  if (!out_.is_open()) {
    write_file(path_, header_of(metrics));
    out_.open(path_, std::ios::app);
  }
  out_ << row_of(frame, metrics) << std::flush;
  if (!out_) throw Error(ErrorCode::io, path_.string(), "cannot write: is the disk full?");
}

}  // namespace firn
