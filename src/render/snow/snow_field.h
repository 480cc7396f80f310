// SPDX-License-Identifier: MIT
// The snow as fields on the corners of the render grid's cells: RenderGrid -> tiles of splatted particles ->
// corners. `density` is the mass by P2G's weights: its integral is the particles' mass. `fill` is the same of
// the volume that particles were placed with, 1 in evenly packed snow; where it is half that, the smooth
// surface lies. Particles with little company count for a little more in the fill, so that snow which
// stretches stays closed until it tears; those that are all but alone are loose: balls of their own
// volume beside it. Both fields are trilinear between corners. As a medium the snow has the density where the
// surface, or in `spheres` the particles' balls, enclose it.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "kernels/shade/table.h"
#include "src/core/aligned.h"
#include "src/render/setup.h"
#include "src/render/snow/render_grid.h"

namespace firn {

// In the corners of a brick.
inline int corner_index(int x, int y, int z) {
  return (x * kernels::kCornerSide + y) * kernels::kCornerSide + z;
}

// Where a scattering of mean cosine g in an extinction sigma is taken for an isotropic one in sigma (1 - g):
// nowhere; in deep cells; or after a path's first collision in thick snow, whichever cells come then.
enum class Similarity { never, by_depth, by_collisions };
// In a tile of corners, from -1 on.
inline int field_tile_index(int x, int y, int z) {
  return ((x + 1) * kernels::kFieldTileSide + y + 1) * kernels::kFieldTileRow + z + 1;
}

struct SnowOptics {
  float g = 0.89f;  // mean cosine of a scattering
  Similarity similarity = Similarity::by_depth;
  // Whether something else than snow may be in a box (render space, m); null: walks stop at every collision.
  std::function<bool(const Vec3f& low, const Vec3f& high)> shared = nullptr;
  std::uint32_t most_scattered = kernels::kMostScattered;  // of one walk
};

class SnowField {
 public:
  explicit SnowField(const kernels::TraceKernels& kernels) : kernels_(kernels) {}

  // `grid` must be built with room for fields and outlive this. smooth: its balls become those of loose
  // particles. The same bits for any thread count.
  void build(RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks,
             SnowShape shape = SnowShape::smooth);

  const kernels::SurfaceField& surface() const { return surface_; }  // of `smooth` alone
  // The grid as rays see it that look for the surface or the medium: bricks without any of it are empty.
  const kernels::TraceGrid& view() const { return view_; }

  // Finds the majorants and the depths of cells; once a frame, for `collide` and `wander`. A cell lies at
  // least d deep if for some n up to 8 it and all cells within n of it (Chebyshev) are snow of at least d / n
  // each. by_depth: class 1 are cells at least 5 mean free paths deep, enough for similarity, so that their
  // extinction is reduced. by_collisions: classes 1 to 5 begin at 0.4, 0.8, 1.6, 3 and 5 reduced mean free
  // paths, and nothing is reduced but by the rays' share. Thick are cells within 12 of one of class 4.
  kernels::MediumField medium(const SnowOptics& optics);

  // Unit normal, outward, at a point (render space) of the surface, from the fill's gradient; `otherwise`
  // where there is none.
  Vec3f normal(const Vec3f& p, const Vec3f& otherwise) const;
  // The particle (sorted index) whose centre is nearest among the cells around p. Many at once:
  // ShadeKernels::nearest.
  std::uint32_t particle_near(const Vec3f& p) const;
  // Of a point where a ray met the surface: any particle if rounding has moved it away from all, as it does
  // to points that are seen from ten thousand kilometres.
  std::uint32_t particle_at_surface(const Vec3f& p) const;

  // For many normals at once (ShadeKernels::normals).
  kernels::GradientField gradients() const { return {gradient_at_.data(), gradient_.data()}; }
  // kg/m^3, at each of many points (TraceKernels::probe).
  void probe_density(const kernels::ProbeView& probes, float distance, std::size_t count,
                     float* density) const {
    kernels_.probe(grid_->view(), density_.data(), probes, distance, 0, count, density);
  }
  // kg/m^3; 0 outside the cells.
  float density(const Vec3f& p) const;
  float fill(const Vec3f& p) const;
  // The largest density in a cell of an occupied brick (its place as in cell_index), kg/m^3.
  float majorant(std::size_t cell) const;

  double mass() const;  // kg, integral of the density
  // kg, what of it the medium has: inside the surface, which clips the rest, and in balls; to 4x4x4 points a
  // cell. Without strays, which are in neither.
  double medium_mass() const;

  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  struct Place {  // in a cell of an occupied brick
    std::size_t slot;
    int cell[3];  // in the brick
    float part[3];
  };
  struct Span {
    float least = 0, most = 0;
  };
  struct CellSpans {  // of the corners of each cell of a brick
    float least[kernels::kCellsPerBrick], most[kernels::kCellsPerBrick];
  };
  bool find(const Vec3f& p, Place& place) const;
  float interpolate(const std::vector<float>& field, const Place& place) const;
  double mean_density(std::size_t cell) const;
  double enclosed_density(Place place, std::uint64_t in_balls) const;
  template <class Done>
  void splat(const std::vector<float>& amount, std::vector<float>& corners, Done&& done);
  bool splat_bricks(const std::vector<float>& amount);
  template <class Done>
  void gather_corners(std::vector<float>& corners, bool from_zero, Done&& done);
  bool add_to_fill(const std::vector<float>& amount);
  void weigh(const Snapshot& snapshot, const std::vector<SnowLook>& looks);
  void splat_snow(const std::vector<SnowLook>& looks, bool smooth);
  void splat_optics(const Snapshot& snapshot, const std::vector<SnowLook>& looks);
  void close_surface(RenderGrid& grid, const Snapshot& snapshot);
  void add_company();
  void find_loose(const Snapshot& snapshot);
  void note_span(std::size_t slot);
  CellSpans cell_spans(std::size_t slot) const;
  bool filled(std::size_t slot, float enough) const;
  void fill_at_particles(std::size_t slot);
  void find_kinds();
  void close_bricks();
  void measure_gradients();
  void fill_around(std::size_t slot, float* tile) const;
  void find_neighbours();
  std::size_t around(std::size_t slot, int k) const {  // SIZE_MAX where no brick is occupied
    return neighbours_[slot][k] < 0 ? SIZE_MAX : static_cast<std::size_t>(neighbours_[slot][k]);
  }
  void measure_strays(const Snapshot& snapshot, const std::vector<SnowLook>& looks);
  void mark_depth(const std::vector<std::uint64_t>& cells, std::uint32_t its);
  void find_depths(const std::vector<float>& density, const SnowOptics& optics);
  void find_cells(const kernels::MediumField& field);
  void mark_shared(const SnowOptics& optics);

  const kernels::TraceKernels& kernels_;
  const RenderGrid* grid_ = nullptr;
  kernels::SurfaceField surface_;
  kernels::TraceGrid view_;
  std::vector<std::int32_t> slot_;                        // per brick of the table
  std::vector<std::array<std::int32_t, 27>> neighbours_;  // per occupied brick, x slowest: slots, or -1
  std::vector<float> fill_, density_;                     // per occupied brick kBrickCorners
  std::vector<std::uint32_t> kind_;                       // per occupied brick eight words
  std::vector<std::uint32_t> gradient_at_;  // per occupied brick: its place in gradient_, or kNone
  std::vector<float> gradient_;             // 1/m, per brick that the surface crosses 3 x kBrickCorners
  AlignedArray<float> tile_;                // per brick that splats kFieldTile
  std::vector<std::uint32_t> tile_at_;      // per occupied brick: its place in tile_, or kNone
  // Of the building alone, by sorted index; kept, since fresh memory costs more than filling it.
  std::vector<float> volume_, mass_;  // m^3 and kg, over those of a cell
  std::vector<float> optical_;        // m^2, likewise, where objects differ in their extinction
  std::vector<float> radii_;          // m, of balls beside the surface; -1: the surface covers it
  std::vector<float> counts_, more_;  // for how many each counts in the fill; what a round adds
  std::vector<float> here_;           // fill
  std::vector<Span> spans_;           // of the fill, per occupied brick
  // Per occupied brick: whether its particles add anything; whether none of them is loose.
  std::vector<std::uint8_t> splats_, covered_;
  // The medium. Where objects differ in their extinction, that itself is a field.
  std::vector<float> sigma_;             // 1/m, as density_; or none
  float extinction_ = 0;                 // m^2/kg, of the density; 1 for sigma_
  float ball_density_ = 0;               // as in MediumField, of sigma_ or density_
  float loose_density_ = 0;              // kg/m^3, of loose balls
  std::vector<float> stray_extinction_;  // 1/m, as in MediumField
  // Per occupied brick eight words, four bits a cell: the class of its depth, kThickSnow.
  std::vector<std::uint32_t> depth_;
  std::vector<std::uint32_t> cells_;  // as in MediumField
};

}  // namespace firn
