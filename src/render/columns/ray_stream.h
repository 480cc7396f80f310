// SPDX-License-Identifier: MIT
// Columns of rays, as the trace kernels read them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/trace/table.h"
#include "src/core/vector.h"

namespace firn {

// Of WalkView::scattered.
inline int walked_times(std::uint32_t scattered) { return static_cast<int>(scattered & 0xfffffff); }
inline int walked_class(std::uint32_t scattered) { return static_cast<int>(scattered >> 28); }

// Where walks are to be connected to lights, each ray's collisions in order.
class LitCollisions {
 public:
  void clear(std::size_t rays) {
    count_ = 0;
    if (rays <= rays_) return;
    rays_ = rays;
    room_ = std::make_unique_for_overwrite<kernels::LitCollision[]>(kernels::kMostLit *
                                                                    rays);  // mostly untouched
  }
  std::span<const kernels::LitCollision> all() const { return {room_.get(), count_}; }

 private:
  friend class RayStream;
  std::size_t count_ = 0, rays_ = 0;
  std::unique_ptr<kernels::LitCollision[]> room_;
};

class RayStream {
 public:
  void clear() { size_ = 0; }
  void push(const Vec3f& origin, const Vec3f& direction, float reach) {
    if (size_ == t_.size()) grow();
    for (int a = 0; a < 3; ++a) {
      origin_[a][size_] = origin[a];
      direction_[a][size_] = direction[a];
    }
    t_[size_] = reach;
    hit_[size_] = kernels::kNoHit;
    ++size_;
  }

  // `count` rays from one point, whose directions are the caller's to fill.
  void begin(std::size_t count, const Vec3f& origin, float reach) {
    while (t_.size() < count) size_ = t_.size(), grow();
    size_ = count;
    for (int a = 0; a < 3; ++a) std::fill_n(origin_[a].begin(), count, origin[a]);
    std::fill_n(t_.begin(), count, reach);
  }
  float* directions(int a) { return direction_[a].data(); }

  std::size_t size() const { return size_; }
  Vec3f origin(std::size_t i) const { return {origin_[0][i], origin_[1][i], origin_[2][i]}; }
  Vec3f direction(std::size_t i) const { return {direction_[0][i], direction_[1][i], direction_[2][i]}; }
  float& t(std::size_t i) { return t_[i]; }
  float t(std::size_t i) const { return t_[i]; }
  std::uint32_t hit(std::size_t i) const { return hit_[i]; }
  // Of the last walks(): how often ray i scattered, and in which class of depth the last time.
  int scattered(std::size_t i) const { return walked_times(scattered_[i]); }
  int last_depth(std::size_t i) const { return walked_class(scattered_[i]); }
  Vec3f at_hit(std::size_t i) const { return origin(i) + t_[i] * direction(i); }

  kernels::RayView view() {
    return {{origin_[0].data(), origin_[1].data(), origin_[2].data()},
            {direction_[0].data(), direction_[1].data(), direction_[2].data()},
            t_.data(),
            hit_.data()};
  }

  kernels::WalkView walks(LitCollisions& lit) {
    scattered_.resize(t_.size());
    lit.clear(t_.size());
    return {{origin_[0].data(), origin_[1].data(), origin_[2].data()},
            {direction_[0].data(), direction_[1].data(), direction_[2].data()},
            t_.data(),
            hit_.data(),
            scattered_.data(),
            lit.room_.get(),
            &lit.count_};
  }

 private:
  void grow() {
    const std::size_t room = size_ < 512 ? 1024 : 2 * size_;
    for (auto& column : origin_) column.resize(room);
    for (auto& column : direction_) column.resize(room);
    t_.resize(room);
    hit_.resize(room);
  }

  std::size_t size_ = 0;  // of the columns' room
  std::vector<float> origin_[3], direction_[3], t_;
  std::vector<std::uint32_t> hit_, scattered_;  // scattered_: of walks alone
};

}  // namespace firn
