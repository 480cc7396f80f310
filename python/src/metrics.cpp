// SPDX-License-Identifier: MIT
#include "python/src/metrics.h"

#include "python/src/values.h"

namespace firn::python {
namespace {

py::list contacts_of(const Metrics& m) {
  py::list contacts;
  for (const ContactForce& contact : m.contacts)
    contacts.append(py::make_tuple(contact.collider, array_of(contact.force), array_of(contact.torque)));
  return contacts;
}

}  // namespace

py::dict fields_of(const Metrics& m) {
  py::dict all;
  all["time"] = m.time;
  all["steps"] = m.steps;
  all["particle_steps"] = m.particle_steps;
  all["particles"] = m.particles;
  all["particles_left"] = m.particles_left;
  all["particles_asleep"] = m.particles_asleep;
  all["mass"] = m.mass;
  all["momentum"] = array_of(m.momentum);
  all["angular_momentum"] = array_of(m.angular_momentum);
  all["kinetic_energy"] = m.kinetic_energy;
  all["elastic_energy"] = m.elastic_energy;
  all["potential_energy"] = m.potential_energy;
  all["plastic_work"] = m.plastic_work;
  all["volume"] = m.volume;
  all["density_p05"] = m.density_p05;
  all["density_p50"] = m.density_p50;
  all["density_p95"] = m.density_p95;
  all["front"] = m.front;
  all["max_speed"] = m.max_speed;
  all["bounds_min"] = array_of(m.bounds_min);
  all["bounds_max"] = array_of(m.bounds_max);
  all["step"] = py::make_tuple(m.step.dt, m.step.cause);
  all["contacts"] = contacts_of(m);
  return all;
}

}  // namespace firn::python
