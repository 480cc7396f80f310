// SPDX-License-Identifier: MIT
// The particles as they stand -> the columns of a snapshot, in world axes.
#include <Eigen/Geometry>
#include <algorithm>

#include "src/core/parallel.h"
#include "src/core/rotation.h"
#include "src/mpm/measure.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// How far the particle has turned, in world axes. F is the elastic part: yielding keeps its rotation, and
// where strains are small F takes up the whole spin of the snow.
PackedRotation rotation_in_world(const Solver::State& s, std::size_t i) {
  Mat3 rotation = polar_rotation(matrix_at(s.particles.view().F, i));
  if (const auto& frame = s.setup.frame) rotation = frame->rotation * rotation * frame->rotation.transpose();
  return pack_rotation(rotation);
}

// The block in the middle of the snow: positions of a snapshot count from its corner.
BlockCoord middle_block(const std::vector<BlockCoord>& blocks) {
  if (blocks.empty()) return {0, 0, 0};
  BlockCoord low = blocks.front(), high = low;
  for (const BlockCoord& b : blocks) {
    low = {std::min(low.x, b.x), std::min(low.y, b.y), std::min(low.z, b.z)};
    high = {std::max(high.x, b.x), std::max(high.y, b.y), std::max(high.z, b.z)};
  }
  return {(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2};
}

// A second-order tensor of the simulation's frame.
Mat3 tensor_in_world(const Solver::State& s, const Mat3& local) {
  if (!s.setup.frame) return local;
  return s.setup.frame->rotation * local * s.setup.frame->rotation.transpose();
}

void put(const Mat3& m, std::size_t i, Columns<float, 9>& out) {
  for (int k = 0; k < 9; ++k) out[static_cast<std::size_t>(k)][i] = static_cast<float>(m(k / 3, k % 3));
}

void copy_state(const Solver::State& s, std::size_t i, Snapshot& out) {
  const kernels::ParticleView p = s.particles.view();
  if (!out.F.empty()) put(tensor_in_world(s, matrix_at(p.F, i)), i, out.F);
  if (!out.Jp.empty()) out.Jp[i] = p.Jp[i];
  if (!out.J.empty()) out.J[i] = static_cast<float>(volume_now(s, i) / volume_as_placed(s, i));
}

void copy_stress(const Solver::State& s, kernels::ParticleRange range, Snapshot& out) {
  if (out.stress.empty()) return;
  const std::size_t count = range.end - range.begin;
  std::vector<float> tau(6 * count);  // xx yy zz xy xz yz
  s.kernels.mpm.stress(s.materials.data(), s.particles.view(), range, tau.data(), count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t k) { return static_cast<double>(tau[k * count + i]); };
    Mat3 m;
    m << at(0), at(3), at(4), at(3), at(1), at(5), at(4), at(5), at(2);
    put(tensor_in_world(s, m), range.begin + i, out.stress);
  }
}

}  // namespace

void Solver::snapshot(Snapshot& out, const StateColumns& columns) const {
  const State& s = *state_;
  const kernels::ParticleView p = s.particles.view();
  const BlockCoord origin = middle_block(s.blocks.coord);
  out.time = s.time;
  out.dx = s.setup.dx;
  out.driven = driven_now(s);
  out.origin = array_of(point_in_world(s.setup.frame, world_in_block(origin, Vec3::Zero(), s.setup.dx)));
  out.resize(s.particles.size(), columns);
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    const BlockCoord& c = s.blocks.coord[b];
    const BlockCoord relative{c.x - origin.x, c.y - origin.y, c.z - origin.z};
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i) {
      const Vec3 x = vector_in_world(s.setup.frame, position(s, relative, i));
      const Vec3 v = vector_in_world(s.setup.frame, Vec3(p.v[0][i], p.v[1][i], p.v[2][i]));
      const PackedRotation rotation = rotation_in_world(s, i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        out.position[axis][i] = static_cast<float>(x[a]);
        out.velocity[axis][i] = static_cast<float>(v[a]);
        out.rotation[axis][i] = rotation[axis];
      }
      out.density[i] = static_cast<float>(p.m[i] / volume_now(s, i));
      out.volume0[i] = static_cast<float>(volume_as_placed(s, i));
      out.id[i] = p.id[i];
      out.object[i] = static_cast<std::uint16_t>(p.object[i]);
      copy_state(s, i, out);
    }
    copy_stress(s, s.range_of(b), out);
  });
}

}  // namespace firn
