// SPDX-License-Identifier: MIT
// Placed snow -> particle columns in block order, material tables and the scene's energy budget.
#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// The velocity gradient of an object that moves rigidly or affinely (a spin), from its particles' velocities;
// zero for any other field. Without it the first transfer would lose the part of a spin that lies within the
// stencils.
Mat3 affine_velocity(const PlacedSnow& snow) {
  Vec3 mean_x = Vec3::Zero(), mean_v = Vec3::Zero();
  const double weight = 1.0 / static_cast<double>(snow.position.size());
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    mean_x += weight * snow.position[i];
    mean_v += weight * snow.velocity[i];
  }
  Mat3 spread = Mat3::Zero(), shear = Mat3::Zero();
  double motion2 = 0;
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    const Vec3 x = snow.position[i] - mean_x, v = snow.velocity[i] - mean_v;
    spread += x * x.transpose();
    shear += v * x.transpose();
    motion2 += v.squaredNorm();
  }
  const double scale = spread.trace();
  if (motion2 < 1e-20 || spread.determinant() < 1e-9 * scale * scale * scale) return Mat3::Zero();
  const Mat3 gradient = shear * spread.inverse();
  double residual2 = 0;
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    residual2 += (snow.velocity[i] - mean_v - gradient * (snow.position[i] - mean_x)).squaredNorm();
  }
  return residual2 < 1e-6 * motion2 ? gradient : Mat3::Zero();
}

kernels::MaterialParams material_params(const Material& m) {
  const ElasticModuli moduli = elastic_moduli(m);
  kernels::MaterialParams out{};
  out.kind = m.model;
  out.plastic = m.plasticity;
  out.mu = static_cast<float>(moduli.mu);
  out.lambda = static_cast<float>(moduli.lambda);
  out.inverse_density = static_cast<float>(1 / m.density);
  out.hardening = static_cast<float>(m.hardening);
  out.jp_min = static_cast<float>(m.jp_min);
  out.jp_max = static_cast<float>(m.jp_max);
  kernels::AllMaterials::visit(m.model, [&](auto material) {
    material.fill(m, {moduli.mu, moduli.lambda}, out);
  });
  return out;
}

// Quadratic drag -k |v| v that balances gravity at the terminal velocity. Without gravity nothing has one.
std::vector<float> drag_of(const SolverSetup& setup) {
  std::vector<float> drag;
  for (const PlacedSnow& snow : setup.snow) {
    const double v = snow.terminal_velocity.value_or(HUGE_VAL);
    drag.push_back(static_cast<float>(setup.gravity.norm() / (v * v)));
  }
  const bool any = std::any_of(drag.begin(), drag.end(), [](float k) { return k > 0; });
  return any ? drag : std::vector<float>();
}

LatticePoint to_lattice(const Vec3& world, double dx) {
  const auto fixed = [dx](double w) {
    const double cells = std::clamp(w / dx, -1e9, 1e9);
    return static_cast<std::int64_t>(std::floor(cells * kernels::kOneCell + 0.5));
  };
  return {fixed(world.x()), fixed(world.y()), fixed(world.z())};
}

// Particle ids count through the snow objects in turn.
class Sources {
 public:
  explicit Sources(const std::vector<PlacedSnow>& snow) {
    for (const PlacedSnow& s : snow) first_.push_back(first_.back() + s.position.size());
  }
  std::size_t count() const { return first_.back(); }
  std::size_t object_of(std::size_t id) const {
    return static_cast<std::size_t>(std::upper_bound(first_.begin(), first_.end(), id) - first_.begin()) - 1;
  }
  std::size_t index_of(std::size_t id, std::size_t object) const { return id - first_[object]; }

 private:
  std::vector<std::size_t> first_{0};  // id of each object, and the end
};

template <class T>
void release(std::vector<T>& values) {  // `= {}` would keep the memory
  std::vector<T>().swap(values);
}

void fill_place(const kernels::ParticleView& p, std::size_t i, const LatticePoint& at) {
  constexpr std::int64_t kInBlock = 4ll * kernels::kOneCell - 1;
  p.x[0][i] = static_cast<std::int32_t>(at.x & kInBlock);
  p.x[1][i] = static_cast<std::int32_t>(at.y & kInBlock);
  p.x[2][i] = static_cast<std::int32_t>(at.z & kInBlock);
}

void fill_velocity(const kernels::ParticleView& p, std::size_t i, const Vec3& velocity) {
  for (int axis = 0; axis < 3; ++axis) p.v[axis][i] = static_cast<float>(velocity[axis]);
}

void fill_material(const kernels::ParticleView& p, std::size_t i, const PlacedSnow& snow, std::size_t index,
                   const Mat3& gradient) {
  for (int k = 0; k < 9; ++k) {
    p.C[k][i] = static_cast<float>(gradient(k / 3, k % 3));
    p.F[k][i] = !snow.strain.empty() ? snow.strain[index](k / 3, k % 3) : k % 4 == 0 ? 1.f : 0.f;
  }
  p.Jp[i] = snow.packing.empty() ? 1.f : snow.packing[index];
  p.m[i] = static_cast<float>(snow.volume_of(index) * snow.material.density);
}

// Positions and velocities are given back before most of the columns are touched, so that placing snow takes
// no more memory than stepping it.
void fill_columns(Solver::State& state) {
  std::vector<PlacedSnow>& snow = state.setup.snow;
  const Sources sources(snow);
  std::vector<Mat3> gradients;
  gradients.reserve(snow.size());
  for (const PlacedSnow& s : snow) gradients.push_back(affine_velocity(s));
  const auto place = [&](std::size_t id) {
    const std::size_t object = sources.object_of(id);
    return to_lattice(snow[object].position[sources.index_of(id, object)], state.setup.dx);
  };
  const std::vector<std::uint32_t> order =
      place_in_blocks(sources.count(), place, state.setup.dx, state.blocks);
  state.particles.allocate(order.size());
  const kernels::ParticleView p = state.particles.view();
  const auto for_each = [&](auto&& f) {  // particle, object, index in it
    parallel_for(order.size(), 4096, [&](std::size_t i) {
      const std::size_t object = sources.object_of(order[i]);
      f(i, object, sources.index_of(order[i], object));
    });
  };
  for_each([&](std::size_t i, std::size_t object, std::size_t index) {
    fill_place(p, i, place(order[i]));
    fill_velocity(p, i, snow[object].velocity[index]);
    p.id[i] = order[i];
    p.object[i] = static_cast<std::uint32_t>(object);
  });
  for (PlacedSnow& s : snow) {
    release(s.position);
    release(s.velocity);
  }
  for_each([&](std::size_t i, std::size_t object, std::size_t index) {
    fill_material(p, i, snow[object], index, gradients[object]);
  });
  for (PlacedSnow& s : snow) {
    release(s.packing);
    release(s.volume);
    release(s.strain);
  }
}

// m^3, of its smallest and its largest particle.
std::pair<double, double> volume_range(const PlacedSnow& snow) {
  if (snow.volume.empty()) return {snow.particle_volume, snow.particle_volume};
  const auto [least, greatest] = std::minmax_element(snow.volume.begin(), snow.volume.end());
  return {*least, *greatest};
}

// What the elastic strain at the start may be, and the per cent that round-off and placing may add.
double greatest_strain(const PlacedSnow& snow) {
  double greatest = 0;
  for (const Eigen::Matrix3f& f : snow.strain) {
    const Mat3 F = f.cast<double>();
    greatest = std::max(greatest, 0.5 * (F.transpose() * F - Mat3::Identity()).norm());
  }
  return std::max(0.01, greatest);
}

// More snow, of which the scene may make speed.
void add_to_budget(Solver::State& state, const PlacedSnow& snow) {
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    state.budget.start_speed = std::max(state.budget.start_speed, snow.velocity[i].norm());
    state.budget.top = std::max(state.budget.top, height_against(state.setup.gravity, snow.position[i]));
  }
  if (snow.position.empty()) return;
  const auto [least, greatest] = volume_range(snow);
  const auto floor = static_cast<float>(1e-12 * (least * snow.material.density));
  const ElasticModuli moduli = elastic_moduli(snow.material);
  // A yielding particle's work is some 10^-7 to 10^-3 of it in a step.
  const double stiffness = (moduli.lambda + 2 * moduli.mu) * greatest, quanta = 0x1p40 / stiffness;
  state.mass_floor = state.mass_floor > 0 ? std::min(state.mass_floor, floor) : floor;
  state.work_quanta = state.work_quanta > 0 ? std::min(state.work_quanta, quanta) : quanta;
  state.budget.elastic_speed =
      std::max(state.budget.elastic_speed, greatest_strain(snow) * moduli.p_wave_speed);
}

void check_finite(const PlacedSnow& snow) {
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    if (snow.position[i].allFinite() && snow.velocity[i].allFinite()) continue;
    throw Error(ErrorCode::usage, "",
                "a particle of snow '" + snow.name + "' has a position or velocity that is not finite");
  }
}

void check_count(std::size_t particles, std::size_t objects) {
  if (particles >= UINT32_MAX)
    throw Error(ErrorCode::usage, "", "more than 4,294,967,294 particles: choose a larger dx");
  if (objects > UINT16_MAX + std::size_t{1})  // Snapshot::object
    throw Error(ErrorCode::usage, "", "more than 65,536 snow objects");
}

void check_placed(const std::vector<PlacedSnow>& snow) {
  std::size_t count = 0;
  for (const PlacedSnow& s : snow) {
    count += s.position.size();
    check_finite(s);
  }
  if (count == 0) throw Error(ErrorCode::usage, "", "there is no snow: not one particle was placed");
  check_count(count, snow.size());
}

// Where the particles are, on the lattice of the whole world.
std::vector<LatticePoint> places_of(const Solver::State& state) {
  const kernels::ParticleView p = state.particles.view();
  std::vector<LatticePoint> places(state.particles.size());
  parallel_for(state.blocks.size(), 4, [&](std::size_t b) {
    const BlockCoord& c = state.blocks.coord[b];
    const auto at = [](std::int32_t block, std::int32_t x) {
      return std::int64_t{block} * 4 * kernels::kOneCell + x;
    };
    for (std::size_t i = state.blocks.begin[b]; i < state.blocks.begin[b + 1]; ++i)
      places[i] = {at(c.x, p.x[0][i]), at(c.y, p.x[1][i]), at(c.z, p.x[2][i])};
  });
  return places;
}

// What a block of the old particles and new ones has been through: none is calmer than its liveliest part.
std::vector<float> calm_of(const ParticleBlocks& old, const ParticleBlocks& blocks,
                           const std::vector<std::uint32_t>& order) {
  std::vector<float> calm(blocks.size());
  parallel_for(blocks.size(), 16, [&](std::size_t b) {
    float least = HUGE_VALF;
    for (std::size_t i = blocks.begin[b]; i < blocks.begin[b + 1]; ++i) {
      const auto after = std::upper_bound(old.begin.begin(), old.begin.end(), std::size_t{order[i]});
      const auto was = static_cast<std::size_t>(after - old.begin.begin()) - 1;
      least = std::min(least, was < old.size() ? old.calm[was] : 0.f);
    }
    calm[b] = least;
  });
  return calm;
}

}  // namespace

double height_against(const Vec3& gravity, const Vec3& x) {
  const double g = gravity.norm();
  return g > 0 ? -gravity.dot(x) / g : 0.0;
}

void place_particles(Solver::State& state) {
  check_placed(state.setup.snow);
  state.budget.top = -HUGE_VAL;
  for (const PlacedSnow& snow : state.setup.snow) add_to_budget(state, snow);
  state.rest = rest_limits(state.setup);
  for (const PlacedSnow& snow : state.setup.snow) state.materials.push_back(material_params(snow.material));
  state.air_drag = drag_of(state.setup);
  fill_columns(state);
  state.next_id = static_cast<std::uint32_t>(state.particles.size());
}

// The old particles keep their place to the last bit, and new ones are sorted in among them.
void Solver::State::add(PlacedSnow snow) {
  require_idle();
  require_sound();
  check_finite(snow);
  check_count(next_id + snow.position.size(), setup.snow.size() + 1);
  if (setup.frame) into_frame(*setup.frame, snow);
  const std::size_t old_count = particles.size(), object = setup.snow.size();
  const std::vector<LatticePoint> old_places = places_of(*this);
  const auto place = [&](std::size_t n) {
    return n < old_count ? old_places[n] : to_lattice(snow.position[n - old_count], setup.dx);
  };
  ParticleBlocks new_blocks;
  const std::vector<std::uint32_t> order =
      place_in_blocks(old_count + snow.position.size(), place, setup.dx, new_blocks);
  ParticleColumns new_particles;
  new_particles.allocate(order.size());
  // Nothing below fails.
  new_blocks.calm = calm_of(blocks, new_blocks, order);
  const Mat3 gradient = affine_velocity(snow);
  const kernels::ParticleView p = new_particles.view();
  parallel_for(order.size(), 4096, [&](std::size_t i) {
    const std::size_t n = order[i];
    if (n < old_count) {
      for (std::size_t k = 0; k < kColumns; ++k) new_particles.column(k)[i] = particles.column(k)[n];
      fill_place(p, i, place(n));
      return;
    }
    const std::size_t index = n - old_count;
    fill_place(p, i, place(n));
    fill_velocity(p, i, snow.velocity[index]);
    fill_material(p, i, snow, index, gradient);
    p.id[i] = next_id + static_cast<std::uint32_t>(index);
    p.object[i] = static_cast<std::uint32_t>(object);
  });
  next_id += static_cast<std::uint32_t>(snow.position.size());
  ++added;
  add_to_budget(*this, snow);
  materials.push_back(material_params(snow.material));
  release(snow.position);
  release(snow.velocity);
  release(snow.packing);
  release(snow.volume);
  release(snow.strain);
  setup.snow.push_back(std::move(snow));
  air_drag = drag_of(setup);
  rest = rest_limits(setup);
  particles = std::move(new_particles);
  blocks = std::move(new_blocks);
  settle_anew();
}

}  // namespace firn
