// SPDX-License-Identifier: MIT
#include "src/particles/snapshot.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "src/core/aligned.h"
#include "src/core/rotation.h"
#include "src/core/vector.h"
#include "src/particles/column_bytes.h"

namespace firn {

void Snapshot::Free::operator()(std::byte* memory) const { std::free(memory); }

// Visit gets the column, its width and whether it is there.
template <class Visit>
void Snapshot::for_each_column(Snapshot& s, const StateColumns& state, Visit&& visit) {
  visit(s.position, 3, true);
  visit(s.velocity, 3, true);
  visit(s.density, 1, true);
  visit(s.volume0, 1, true);
  visit(s.rotation, 3, true);
  visit(s.id, 1, true);
  visit(s.object, 1, true);
  visit(s.F, 9, state.F);
  visit(s.Jp, 1, state.Jp);
  visit(s.J, 1, state.J);
  visit(s.stress, 9, state.stress);
}

std::size_t Snapshot::lay_out(std::size_t particles, const StateColumns& state, std::byte* memory) {
  state_ = state;
  std::size_t used = 0;
  for_each_column(*this, state, [&](auto& column, std::size_t width, bool wanted) {
    const std::size_t count = wanted ? particles : 0, size = sizeof *column.data();
    const std::size_t bytes = count > 0 ? column_bytes(count, size) : 0;
    using Entry = std::remove_pointer_t<decltype(column.data())>;
    column.data_ = memory != nullptr && count > 0 ? reinterpret_cast<Entry*>(memory + used) : nullptr;
    column.size_ = count;
    if constexpr (requires { column.stride_; }) column.stride_ = bytes / size;
    used += width * bytes;
  });
  return used;
}

void Snapshot::resize(std::size_t particles, const StateColumns& state) {
  const std::size_t bytes = lay_out(particles, state, nullptr);
  if (bytes > capacity_) {
    memory_.reset();
    capacity_ = 0;
    memory_.reset(static_cast<std::byte*>(allocate_aligned(bytes)));
    capacity_ = bytes;
  }
  lay_out(particles, state, memory_.get());
}

Snapshot::Snapshot(std::size_t particles, const StateColumns& state) {
  resize(particles, state);
  if (capacity_ > 0) std::memset(memory_.get(), 0, capacity_);
}

Snapshot::Snapshot(const Snapshot& other)
    : frame(other.frame), time(other.time), origin(other.origin), dx(other.dx), driven(other.driven) {
  resize(other.size(), other.state());
  const std::size_t bytes = lay_out(other.size(), other.state(), memory_.get());
  if (bytes > 0) std::memcpy(memory_.get(), other.memory_.get(), bytes);
}

Snapshot::Snapshot(Snapshot&& other) noexcept { swap(other); }

Snapshot& Snapshot::operator=(Snapshot other) noexcept {
  swap(other);
  return *this;
}

Snapshot::~Snapshot() = default;

void Snapshot::swap(Snapshot& other) noexcept {
  std::swap(frame, other.frame);
  std::swap(time, other.time);
  std::swap(origin, other.origin);
  std::swap(dx, other.dx);
  std::swap(driven, other.driven);
  std::swap(memory_, other.memory_);
  std::swap(capacity_, other.capacity_);
  std::swap(state_, other.state_);
  const std::size_t particles = size();
  lay_out(other.size(), state_, memory_.get());
  other.lay_out(particles, other.state_, other.memory_.get());
}

Matrix3 Snapshot::rotation_matrix(std::size_t i) const {
  return rows_of(unpack_rotation({rotation[0][i], rotation[1][i], rotation[2][i]}).cast<double>());
}

}  // namespace firn
