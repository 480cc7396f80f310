// SPDX-License-Identifier: MIT
// The whole state as bytes: a header that says which simulation it is, counters, blocks, then the particle
// columns in their order. The grid, and who sleeps, are found again from the blocks. Same machine, same build
// family: little-endian, as x86-64 is.
#include <algorithm>
#include <cstring>
#include <istream>
#include <ostream>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

constexpr char kMagic[8] = {'f', 'i', 'r', 'n', 's', 'i', 'm', '4'};

template <class T>
void write(std::ostream& out, const T* values, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  out.write(reinterpret_cast<const char*>(values), static_cast<std::streamsize>(count * sizeof(T)));
}
template <class T>
void read(std::istream& in, T* values, std::size_t count) {
  in.read(reinterpret_cast<char*>(values), static_cast<std::streamsize>(count * sizeof(T)));
  if (!in) throw Error(ErrorCode::io, "", "the saved simulation ends too early");
}

// What must be the same for a saved state to continue as it would have.
std::uint64_t fingerprint(const Solver::State& s) {
  const auto& setup = s.setup;
  std::uint64_t h =
      hash_keys(kColumns, key_of(setup.dx), key_of(setup.fixed_dt.value_or(0)), key_of(setup.max_dt));
  for (int axis = 0; axis < 3; ++axis) h = hash_keys(h, key_of(setup.gravity[axis]));
  for (const kernels::MaterialParams& m : s.materials) {
    std::uint32_t words[sizeof m / 4];
    std::memcpy(words, &m, sizeof m);
    for (const std::uint32_t word : words) h = hash_keys(h, word);
  }
  for (std::size_t k = 0; k < setup.colliders.size(); ++k) {
    h = (is_driven(s, k) ? Motion() : setup.colliders[k].motion).hash(h);
  }
  for (const float drag : s.air_drag) h = hash_keys(h, key_of(drag));
  if (setup.frame) {
    for (int k = 0; k < 9; ++k) h = hash_keys(h, key_of(setup.frame->rotation(k / 3, k % 3)));
    for (int axis = 0; axis < 3; ++axis) h = hash_keys(h, key_of(setup.frame->translation[axis]));
  }
  return hash_keys(h, setup.colliders.size(), setup.domain.has_value(), setup.sleep);
}

struct Counters {
  double time, last_dt, plastic_work, forces_since;
  double start_speed, elastic_speed, top, work_quanta, mass_floor;  // snow that was added counts in them
  std::uint64_t forces_complete;
  std::uint64_t steps, particle_steps, left, blocks, particles, next_id, driven, changed;
  kernels::BlockSummary summary;
};

// A collider that a program drives, without its driver.
struct SavedKey {
  double time, shift[3], rotation[9];
};
struct SavedDriver {
  std::uint64_t collider;
  SavedKey begin, end;
  double linear[3], angular[3], dt, last_linear[3], last_angular[3], longest_way, top_speed;
};

SavedKey saved_key(const MotionKey& key) {
  SavedKey out{};
  out.time = key.time;
  for (int k = 0; k < 3; ++k) out.shift[k] = key.shift[k];
  for (int k = 0; k < 9; ++k) out.rotation[k] = key.rotation(k / 3, k % 3);
  return out;
}
MotionKey key_of_saved(const SavedKey& saved) {
  MotionKey key;
  key.time = saved.time;
  for (int k = 0; k < 3; ++k) key.shift[k] = saved.shift[k];
  for (int k = 0; k < 9; ++k) key.rotation(k / 3, k % 3) = saved.rotation[k];
  return key;
}

SavedDriver saved_driver(const Driven& d) {
  SavedDriver out{};
  out.collider = d.collider;
  out.begin = saved_key(d.begin);
  out.end = saved_key(d.end);
  for (int k = 0; k < 3; ++k) {
    out.linear[k] = d.velocity.linear[static_cast<std::size_t>(k)];
    out.angular[k] = d.velocity.angular[static_cast<std::size_t>(k)];
    out.last_linear[k] = d.last.linear[k];
    out.last_angular[k] = d.last.angular[k];
  }
  out.dt = d.dt;
  out.longest_way = d.longest_way;
  out.top_speed = d.top_speed;
  return out;
}

Driven driven_of_saved(const SavedDriver& saved) {
  Driven d{saved.collider,
           {},
           key_of_saved(saved.begin),
           key_of_saved(saved.end),
           {},
           saved.dt,
           {},
           {},
           saved.longest_way,
           saved.top_speed};
  for (int k = 0; k < 3; ++k) {
    d.velocity.linear[static_cast<std::size_t>(k)] = saved.linear[k];
    d.velocity.angular[static_cast<std::size_t>(k)] = saved.angular[k];
    d.last.linear[k] = saved.last_linear[k];
    d.last.angular[k] = saved.last_angular[k];
  }
  return d;
}

std::vector<Driven> read_driven(std::istream& in, std::uint64_t count, std::size_t colliders) {
  std::vector<Driven> driven;
  if (count > colliders) throw Error(ErrorCode::io, "", "the saved simulation is damaged");
  for (std::uint64_t n = 0; n < count; ++n) {
    SavedDriver saved{};
    read(in, &saved, 1);
    if (saved.collider >= colliders) throw Error(ErrorCode::io, "", "the saved simulation is damaged");
    driven.push_back(driven_of_saved(saved));
  }
  return driven;
}

// Drivers that were given already go on with what was saved, or from where their collider was put.
void take_driven(std::vector<Driven> driven, double time, Solver::State& s) {
  for (Driven& given : s.driven) {
    const auto saved = std::find_if(driven.begin(), driven.end(),
                                    [&](const Driven& d) { return d.collider == given.collider; });
    if (saved != driven.end()) {
      saved->driver = std::move(given.driver);
    } else {
      driven.push_back({given.collider, std::move(given.driver), {}, {}, {}, 0, {}, {}, 0, 0});
      driven.back().begin.time = driven.back().end.time = time;
    }
  }
  for (const Driven& d : driven) {
    Collider& collider = s.setup.colliders[d.collider];
    std::vector<MotionKey> keys = {d.begin};
    if (d.end.time > d.begin.time) keys.push_back(d.end);
    collider.motion = Motion(std::move(keys), collider.shape.pose.translation);
  }
  s.driven = std::move(driven);
  s.grid.forget_contacts();
}

// A damaged count of particles must not take all memory.
bool may_hold(std::istream& in, std::uint64_t particles) {
  const auto here = in.tellg();
  if (here < 0 || !in.seekg(0, std::ios::end)) {  // a pipe: reading will show it
    in.clear();
    return true;
  }
  const auto left = static_cast<std::uint64_t>(in.tellg() - here);
  in.seekg(here);
  return particles <= left / (kColumns * sizeof(std::uint32_t));
}

// Blocks in ascending order whose ranges cover the particles without a gap.
bool consistent(const ParticleBlocks& blocks, std::size_t particles) {
  if (blocks.begin.front() != 0 || blocks.begin.back() != particles) return false;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (!addressable(blocks.coord[b]) || blocks.begin[b] >= blocks.begin[b + 1]) return false;
    if (b > 0 && blocks.key[b] <= blocks.key[b - 1]) return false;
  }
  return true;
}

// Particles where P2G, or first a sort, can follow them, of objects that there are.
bool within_reach(const ParticleColumns& particles, bool strayed, std::size_t objects) {
  const kernels::ParticleView p = particles.view();
  const std::int32_t margin = (strayed ? 3 : 1) * kernels::kOneCell, block = 4 * kernels::kOneCell;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    for (const std::int32_t* x : p.x) {
      if (x[i] < -margin || x[i] >= block + margin) return false;
    }
    if (p.object[i] >= objects) return false;
  }
  return true;
}

}  // namespace

void Solver::save(std::ostream& out) const {
  const State& s = *state_;
  const std::uint64_t print = fingerprint(s);
  Counters c{};
  c.time = s.time;
  c.last_dt = s.last_step.dt;
  c.plastic_work = s.plastic_work;
  c.forces_since = s.forces.since;
  c.forces_complete = s.forces.complete;
  c.steps = s.steps;
  c.particle_steps = s.particle_steps;
  c.left = s.left;
  c.blocks = s.blocks.size();
  c.particles = s.particles.size();
  c.start_speed = s.budget.start_speed;
  c.elastic_speed = s.budget.elastic_speed;
  c.top = s.budget.top;
  c.work_quanta = s.work_quanta;
  c.mass_floor = static_cast<double>(s.mass_floor);
  c.next_id = s.next_id;
  c.driven = s.driven.size();
  c.changed = s.changed;
  c.summary = s.summary;
  const std::uint64_t cause_length = s.last_step.cause.size();
  write(out, kMagic, sizeof kMagic);
  write(out, &print, 1);
  write(out, &c, 1);
  write(out, &cause_length, 1);
  write(out, s.last_step.cause.data(), cause_length);
  for (const Impulse& impulse : s.forces.impulse) {
    write(out, impulse.linear.data(), 3);
    write(out, impulse.angular.data(), 3);
  }
  for (const Driven& d : s.driven) {
    const SavedDriver saved = saved_driver(d);
    write(out, &saved, 1);
  }
  write(out, s.blocks.coord.data(), s.blocks.size());
  write(out, s.blocks.begin.data(), s.blocks.begin.size());
  write(out, s.blocks.calm.data(), s.blocks.calm.size());
  for (std::size_t k = 0; k < kColumns; ++k) write(out, s.particles.column(k), s.particles.size());
}

void Solver::load(std::istream& in) {
  State& s = *state_;
  char magic[sizeof kMagic];
  std::uint64_t print = 0, cause_length = 0;
  read(in, magic, sizeof magic);
  if (std::memcmp(magic, kMagic, sizeof magic) != 0) {
    throw Error(ErrorCode::io, "", "this is not a saved simulation of this version of firn");
  }
  read(in, &print, 1);
  if (print != fingerprint(s)) {
    throw Error(ErrorCode::io, "",
                "the saved simulation is of another scene: dx, dt, gravity, materials, colliders, their "
                "motion or sleep differ");
  }
  Counters c{};
  read(in, &c, 1);
  read(in, &cause_length, 1);
  const bool fits = s.added > 0 ? c.next_id >= s.next_id : c.next_id == s.next_id;
  if (!fits || c.particles > c.next_id || c.next_id >= UINT32_MAX || c.blocks > c.particles ||
      cause_length > 4096 || !may_hold(in, c.particles)) {
    throw Error(ErrorCode::io, "", "the saved simulation does not fit this scene's number of particles");
  }
  std::string cause(cause_length, ' ');
  read(in, cause.data(), cause_length);
  ContactForces forces(s.setup.colliders.size());
  forces.since = c.forces_since;
  forces.complete = c.forces_complete != 0;
  for (Impulse& impulse : forces.impulse) {
    read(in, impulse.linear.data(), 3);
    read(in, impulse.angular.data(), 3);
  }
  std::vector<Driven> driven = read_driven(in, c.driven, s.setup.colliders.size());
  ParticleBlocks blocks;
  blocks.coord.resize(c.blocks);
  blocks.begin.resize(c.blocks + 1);
  blocks.calm.resize(c.blocks);
  read(in, blocks.coord.data(), c.blocks);
  read(in, blocks.begin.data(), c.blocks + 1);
  read(in, blocks.calm.data(), c.blocks);
  for (const BlockCoord& b : blocks.coord) blocks.key.push_back(block_key(b));
  if (!consistent(blocks, c.particles)) throw Error(ErrorCode::io, "", "the saved simulation is damaged");
  ParticleColumns particles;
  particles.allocate(c.particles);
  for (std::size_t k = 0; k < kColumns; ++k) read(in, particles.column(k), c.particles);
  if (!within_reach(particles, c.summary.strayed, s.materials.size())) {
    throw Error(ErrorCode::io, "", "the saved simulation is damaged: a particle lies beyond its block");
  }

  s.particles = std::move(particles);
  s.blocks = std::move(blocks);
  s.forces = std::move(forces);
  take_driven(std::move(driven), c.time, s);
  if (c.last_dt > 0) s.moving = moving_colliders(s.setup.colliders, c.time - c.last_dt, c.time);
  s.rebuild_grid();
  s.plastic_work = c.plastic_work;
  s.reached = s.time = c.time;
  s.steps = c.steps;
  s.particle_steps = c.particle_steps;
  s.left = c.left;
  s.budget = {c.start_speed, c.elastic_speed, c.top};
  s.work_quanta = c.work_quanta;
  s.mass_floor = static_cast<float>(c.mass_floor);
  s.changed = c.changed != 0;
  s.next_id = static_cast<std::uint32_t>(c.next_id);
  s.summary = c.summary;
  s.last_step = {c.last_dt, cause};
}

}  // namespace firn
