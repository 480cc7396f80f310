// SPDX-License-Identifier: MIT
// The snow as fields on the corners of the render grid's cells: RenderGrid -> tiles of splatted particles ->
// corners. `density` is the mass by P2G's weights: its integral is the particles' mass. `fill` is the same of
// the volume that particles were placed with, 1 in evenly packed snow; where it is half that, the smooth
// surface lies. Particles with little company count for a little more in the fill, so that snow which
// stretches stays closed until it tears; those that are all but alone are loose: balls of their own
// volume beside it. Both fields are trilinear between corners.
#pragma once
#include <cstdint>
#include <vector>

#include "src/render/render_grid.h"

namespace firn {

class SnowField {
 public:
  explicit SnowField(const kernels::TraceKernels& kernels) : kernels_(kernels) {}

  // `grid` must be built with room for fields and outlive this; its balls become those of loose particles.
  // The same bits for any thread count.
  void build(RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks);

  const kernels::SurfaceField& surface() const { return surface_; }
  // The grid as rays see it that look for the surface: bricks without any of it are empty.
  const kernels::TraceGrid& view() const { return view_; }

  // Unit normal, outward, at a point (render space) of the surface, from the fill's gradient; `otherwise`
  // where there is none.
  Vec3f normal(const Vec3f& p, const Vec3f& otherwise) const;
  // The particle (sorted index) whose centre is nearest among the cells around p.
  std::uint32_t particle_near(const Vec3f& p) const;

  // kg/m^3; 0 outside the cells.
  float density(const Vec3f& p) const;
  float fill(const Vec3f& p) const;
  // The largest density in a cell of an occupied brick (its place as in cell_index), kg/m^3.
  float majorant(std::size_t cell) const;

  double mass() const;          // kg, integral of the density
  double clipped_mass() const;  // kg, what of it lies inside the surface; cells are cut by 4x4x4 points

  std::size_t bytes() const;

 private:
  struct Place {  // in a cell of an occupied brick
    std::size_t slot;
    int cell[3];  // in the brick
    float part[3];
  };
  bool find(const Vec3f& p, Place& place) const;
  float interpolate(const std::vector<float>& field, const Place& place) const;
  void splat(const std::vector<float>& amount, std::vector<float>& corners);
  void splat_bricks(const std::vector<float>& amount);
  void gather_corners(std::vector<float>& corners, bool add) const;
  void add_company(const std::vector<float>& volume);
  std::vector<float> loose_radii(const Snapshot& snapshot) const;
  void find_kinds();
  void close_bricks();
  void measure_gradients();
  std::size_t around(std::size_t slot, int k) const;

  const kernels::TraceKernels& kernels_;
  const RenderGrid* grid_ = nullptr;
  kernels::SurfaceField surface_;
  kernels::TraceGrid view_;
  std::vector<std::int32_t> slot_;          // per brick of the table
  std::vector<float> fill_, density_;       // per occupied brick kBrickCorners
  std::vector<std::uint32_t> kind_;         // per occupied brick eight words
  std::vector<std::uint32_t> gradient_at_;  // per occupied brick: its place in gradient_, or kNone
  std::vector<float> gradient_;             // 1/m, per brick that the surface crosses 3 x kBrickCorners
  std::vector<float> tile_;                 // per brick that holds particles kFieldTile
  std::vector<std::uint32_t> tile_at_;      // per occupied brick: its place in tile_, or kNone
};

}  // namespace firn
