// SPDX-License-Identifier: MIT
#pragma once
#include <array>
#include <vector>

#include "bench/embree.h"
#include "bench/rivals.h"

namespace firn::bench {

// Embree's own primitive: one sphere point a ball.
class EmbreePoints : public Tracer {
 public:
  EmbreePoints(const Balls& balls, int threads);

  const char* name() const override { return "embree_points"; }
  void build() override;
  Vec3 origin() const override { return vec(balls_.snapshot.origin); }
  void trace(RayKind kind, const kernels::RayView& rays, std::size_t begin, std::size_t end) override {
    scene_.trace(way_[static_cast<std::size_t>(kind)], kind, rays, begin, end);
  }
  Vec3f center(std::uint32_t hit) const override { return {sphere_[hit].x, sphere_[hit].y, sphere_[hit].z}; }
  std::size_t bytes() const override { return scene_.bytes() + sphere_.size() * sizeof(Sphere); }
  std::vector<std::string> ways() const override { return EmbreeScene::ways(); }
  void choose(RayKind kind, std::size_t way) override { way_[static_cast<std::size_t>(kind)] = way; }

 private:
  struct Sphere {
    float x, y, z, radius;  // m
  };
  const Balls& balls_;
  std::vector<Sphere> sphere_;
  EmbreeScene scene_;
  std::array<std::size_t, kRayKindCount> way_{};
};

}  // namespace firn::bench
