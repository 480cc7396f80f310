// SPDX-License-Identifier: MIT
// The particles at one time, as columns: what a simulation gives and a renderer takes.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "firn/driver.h"
#include "firn/export.h"
#include "firn/vector.h"

namespace firn {

// One value a particle, in memory that belongs to a snapshot. Constant where the snapshot is.
template <class T>
class Column {
 public:
  Column() = default;
  Column(const Column&) = delete;
  Column& operator=(const Column&) = delete;
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  operator std::span<const T>() const { return {data_, size_}; }
  friend bool operator==(const Column& a, const Column& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  friend class Snapshot;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

// `width` values a particle: component k of particle i is (*this)[k][i], at data() + k * stride() + i. Seen
// as one array it has the shape (width, particles).
template <class T, std::size_t width>
class Columns {
 public:
  Columns() = default;
  Columns(const Columns&) = delete;
  Columns& operator=(const Columns&) = delete;
  static constexpr std::size_t kWidth = width;    // values a particle
  std::size_t size() const { return size_; }      // particles
  std::size_t stride() const { return stride_; }  // entries from one component to the next, >= size()
  bool empty() const { return size_ == 0; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  std::span<T> operator[](std::size_t k) { return {data_ + k * stride_, size_}; }
  std::span<const T> operator[](std::size_t k) const { return {data_ + k * stride_, size_}; }

 private:
  friend class Snapshot;
  T* data_ = nullptr;
  std::size_t size_ = 0, stride_ = 0;
};

// Columns that a snapshot has only when they are asked for.
struct StateColumns {
  bool F = false;       // elastic deformation gradient, 36 bytes a particle
  bool Jp = false;      // plastic volume ratio, 4 bytes a particle
  bool J = false;       // volume ratio, 4 bytes a particle
  bool stress = false;  // Kirchhoff stress, 36 bytes a particle
};

// A copy of the state, which goes on without it. All columns lie in one allocation. A value: copies are
// independent. One object must not be changed while another thread uses it.
class FIRN_API Snapshot {
 public:
  Snapshot() = default;
  // Columns full of zeros.
  explicit Snapshot(std::size_t particles, const StateColumns& state = {});
  Snapshot(const Snapshot& other);
  Snapshot(Snapshot&& other) noexcept;
  Snapshot& operator=(Snapshot other) noexcept;
  ~Snapshot();

  int frame = 0;     // of a run: which frame it is of; 0 from a simulation
  double time = 0;   // s of simulated time
  Vector3 origin{};  // m, world; positions are relative to it so that float stays exact far from 0
  double dx = 0;     // m, the simulation's grid spacing
  std::vector<DrivenCollider> driven;  // where the colliders are that a program drives, in the scene's order

  // One entry a particle, in an order in which neighbours in space are near in memory.
  Columns<float, 3> position;  // m, relative to `origin`
  Columns<float, 3> velocity;  // m/s
  Column<float> density;       // kg/m^3, now: mass / (volume0 * J)
  Column<float> volume0;       // m^3, the volume that the particle was placed with
  // How far the particle has rotated since it was placed, world axes: the axis times tan(angle / 4), in
  // 1/32767. All 0: not at all.
  Columns<std::int16_t, 3> rotation;
  Column<std::uint32_t> id;      // unique, constant over the run
  Column<std::uint16_t> object;  // index of the [[snow]] table that the particle came from

  // Empty unless asked for.
  Columns<float, 9> F;       // elastic deformation gradient, row by row, world axes
  Column<float> Jp;          // plastic volume ratio; negative: a layer that collapses has lost its cohesion
  Column<float> J;           // volume now / volume0: det F |Jp|
  Columns<float, 9> stress;  // Pa, Kirchhoff stress tau = det F sigma, row by row, world axes

  std::size_t size() const { return id.size(); }
  Vector3 world_position(std::size_t i) const {  // m, of particle i
    return {origin[0] + static_cast<double>(position[0][i]), origin[1] + static_cast<double>(position[1][i]),
            origin[2] + static_cast<double>(position[2][i])};
  }
  Matrix3 rotation_matrix(std::size_t i) const;  // of particle i

  // Other columns, whose values are left to be written. The memory is used again where it is large enough.
  void resize(std::size_t particles, const StateColumns& state = {});
  const StateColumns& state() const { return state_; }  // those that it has

 private:
  struct Free {
    void operator()(std::byte* memory) const;
  };
  template <class Visit>
  static void for_each_column(Snapshot& snapshot, const StateColumns& state, Visit&& visit);
  std::size_t lay_out(std::size_t particles, const StateColumns& state, std::byte* memory);  // bytes
  void swap(Snapshot& other) noexcept;

  std::unique_ptr<std::byte[], Free> memory_;
  std::size_t capacity_ = 0;  // bytes
  StateColumns state_;
};

}  // namespace firn
