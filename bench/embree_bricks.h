// SPDX-License-Identifier: MIT
#pragma once
#include <array>
#include <string>
#include <vector>

#include "bench/brick_test.h"
#include "bench/embree.h"
#include "bench/rivals.h"

namespace firn::bench {

// How bricks get their rays.
enum class BrickRays {
  singly,   // ray by ray, each against a register of balls: the rival that the aims of the tracer are set
            // against
  packets,  // in whatever way is fastest, packets of 16 against one ball among them: twice as fast
};

// Embree for small balls: a counting sort into bricks, one user primitive a brick, tested in registers. So
// its tree is ten times smaller, and built as much faster. With packets, the strongest way to use it that we
// know of.
class EmbreeBricks : public Tracer {
 public:
  EmbreeBricks(const Balls& balls, const std::string& isa, int threads, BrickRays rays);

  const char* name() const override {
    return rays_ == BrickRays::singly ? "embree_bricks" : "embree_brick_packets";
  }
  // Errors: failed.
  void build() override;
  Vec3 origin() const override { return vec(balls_.snapshot.origin); }
  void trace(RayKind kind, const kernels::RayView& rays, std::size_t begin, std::size_t end) override {
    scene_.trace(way_[static_cast<std::size_t>(kind)], kind, rays, begin, end);
  }
  Vec3f center(std::uint32_t hit) const override;
  // What tracing needs; not the sort's columns.
  std::size_t bytes() const override;
  std::vector<std::string> ways() const override {
    return rays_ == BrickRays::singly ? EmbreeScene::single_ray_ways() : EmbreeScene::ways();
  }
  void choose(RayKind kind, std::size_t way) override { way_[static_cast<std::size_t>(kind)] = way; }

 private:
  void lay_out();
  void count_balls();
  void number_bricks();
  void sort_balls();

  const Balls& balls_;
  BrickRays rays_;
  float low_[3] = {0, 0, 0}, inv_edge_ = 1;  // m, 1/m
  int cells_[3] = {0, 0, 0};
  std::vector<std::uint32_t> cell_of_, rank_;  // of each particle: its cell, its place there
  std::vector<std::uint32_t> cell_;            // balls in it, then the brick that it is
  std::vector<std::uint32_t> start_;           // BrickBalls::start
  std::vector<float> ball_;                    // BrickBalls::ball
  BrickBalls view_{};
  EmbreeScene scene_;
  std::array<std::size_t, kRayKindCount> way_{};
};

}  // namespace firn::bench
