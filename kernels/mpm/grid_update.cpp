// SPDX-License-Identifier: MIT
// Grid nodes of one block: momentum -> velocity, gravity, then contact with colliders (Stomakhin et al. 2013,
// section 8: the velocity relative to the collider loses its normal part, and of its tangential part as much
// as Coulomb friction takes; all of it where static friction can hold it).
#include "kernels/mpm/table.h"
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

namespace {

// The 64 nodes, one array a component: contacts work with one node a lane.
struct NodeColumns {
  alignas(64) float x[kBlockNodes], y[kBlockNodes], z[kBlockNodes];  // velocity, m/s
  alignas(64) float mass[kBlockNodes];                               // kg
};

// v: relative to the collider.
FIRN_INLINE Vec3 after_contact(const ContactNodes& c, const Vec3& v, const Vec3& normal) {
  const Floats zero = splat(0.f);
  if (c.kind == kSticky) return {zero, zero, zero};
  const Floats v_n = dot(v, normal);
  const Vec3 tangential = add_scaled(v, normal, -v_n);
  const Floats speed = sqrt(dot(tangential, tangential));
  const Floats pressed = c.kind == kSlip ? abs(v_n) : max(-v_n, zero);
  const Mask held = less_equal(speed, splat(c.static_friction) * pressed);
  const Floats left = max(speed - splat(c.friction) * pressed, zero) / max(speed, splat(1e-30f));
  const Vec3 slid = tangential * select(held, zero, left);
  return c.kind == kSlip ? slid : select(less(v_n, zero), slid, v);
}

// Where nodes i, i + 1, ... lie from the block's first one, cells.
FIRN_INLINE Vec3 node_offset(int i) {
  const Ints node = lane_numbers() + i;
  return {to_float(node >> 4), to_float(node >> 2 & 3), to_float(node & 3)};
}

// The collider's velocity at nodes i, i + 1, ...
FIRN_INLINE Vec3 collider_velocity(const ContactNodes& c, int i) {
  const Vec3 turn{splat(c.turn[0]), splat(c.turn[1]), splat(c.turn[2])};
  const Vec3 velocity{splat(c.velocity[0]), splat(c.velocity[1]), splat(c.velocity[2])};
  return velocity + cross(turn, node_offset(i));
}

// A sum over the nodes that does not depend on the number of lanes: node n goes into part n mod 8, in order.
class NodeSum {
 public:
  FIRN_INLINE void add(int first, Floats a) {  // nodes first, first + 1, ...; the ones left out are zero
    alignas(64) float lanes[kLanes];
    store(lanes, a);
    constexpr int kWidth = kLanes < kParts ? kLanes : kParts;
    for (int from = 0; from < kLanes; from += kWidth) {
      float* parts = parts_ + first % kParts;
      for (int l = 0; l < kWidth; ++l) parts[l] += lanes[from + l];
    }
  }
  FIRN_INLINE double total() const {
    double two[4];
    for (int k = 0; k < 4; ++k) two[k] = static_cast<double>(parts_[k]) + static_cast<double>(parts_[k + 4]);
    return (two[0] + two[1]) + (two[2] + two[3]);
  }

 private:
  static constexpr int kParts = 8;
  alignas(64) float parts_[kParts] = {};
};

FIRN_INLINE void apply_contact(const ContactNodes& c, std::uint64_t counted, NodeColumns& v,
                               double* impulse) {
  NodeSum sum[kImpulseParts];
  for (int i = 0; i < kBlockNodes; i += kLanes) {
    const Mask touching = less(load(c.distance + i), splat(kTouchingCells));
    if (!any(touching)) continue;
    const Vec3 before{load(v.x + i), load(v.y + i), load(v.z + i)};
    const Vec3 normal{load(c.normal[0] + i), load(c.normal[1] + i), load(c.normal[2] + i)};
    Vec3 after;
    if (c.moving) {
      const Vec3 its = collider_velocity(c, i);
      after = after_contact(c, before - its, normal) + its;
    } else {
      after = after_contact(c, before, normal);
    }
    after = select(touching, after, before);
    store(v.x + i, after.x);
    store(v.y + i, after.y);
    store(v.z + i, after.z);
    const Mask counts = mask_of_bits(static_cast<int>(counted >> i & kAllLanes));
    const Vec3 given = (after - before) * select(counts, load(v.mass + i), splat(0.f));
    const Vec3 moment = cross(node_offset(i), given);
    sum[0].add(i, given.x);
    sum[1].add(i, given.y);
    sum[2].add(i, given.z);
    sum[3].add(i, moment.x);
    sum[4].add(i, moment.y);
    sum[5].add(i, moment.z);
  }
  for (int k = 0; k < kImpulseParts; ++k) impulse[k] += sum[k].total();
}

// The mass of each node in all of its four lanes.
FIRN_INLINE Floats masses_of(Floats nodes) {
#if defined(__AVX512F__)
  return _mm512_permute_ps(nodes, 0xff);
#elif defined(__AVX2__)
  return _mm256_permute_ps(nodes, 0xff);
#else
  return _mm_shuffle_ps(nodes, nodes, 0xff);
#endif
}

FIRN_INLINE void to_velocity(const StepParams& step, float* nodes) {
  const float* g = step.gravity_dt;
  alignas(16) const float gravity_dt[kNodeFloats] = {g[0], g[1], g[2], 0.f};
  const Mask is_mass = equal(lane_numbers() & 3, splat_int(3));
  for (int i = 0; i < kBlockFloats; i += kLanes) {
    const Floats before = load(nodes + i), mass = masses_of(before);
    const Mask carries = less(splat(step.mass_floor), mass);
    const Floats v = before * (splat(1.f) / mass) + load_repeated4(gravity_dt);
    store(nodes + i, select(is_mass, before, select(carries, v, splat(0.f))));
  }
}

}  // namespace

void grid_update(const StepParams& step, const ContactNodes* contacts, int contact_count,
                 std::uint64_t counted, float* nodes, double* impulses) {
  to_velocity(step, nodes);
  if (contact_count == 0) return;
  NodeColumns v;
  for (int i = 0; i < kBlockNodes; ++i) {
    v.x[i] = nodes[4 * i];
    v.y[i] = nodes[4 * i + 1];
    v.z[i] = nodes[4 * i + 2];
    v.mass[i] = nodes[4 * i + 3];
  }
  for (int k = 0; k < contact_count; ++k) {
    apply_contact(contacts[k], counted, v, impulses + kImpulseParts * contacts[k].collider);
  }
  for (int i = 0; i < kBlockNodes; ++i) {
    nodes[4 * i] = v.x[i];
    nodes[4 * i + 1] = v.y[i];
    nodes[4 * i + 2] = v.z[i];
  }
}

}  // namespace firn::kernels::FIRN_ISA
