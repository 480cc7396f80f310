// SPDX-License-Identifier: MIT
// Pictures at once, without noise: the integrator `preview`. One ray through the middle of each pixel, one
// shadow ray to the middle of each sun and lamp, and estimates for the rest, a tile of pixels at a time:
//
//   camera rays -> what they meet (mirrors and glass send them on) -> snow below and before each point
//               -> shadow rays -> shading -> picture
//
// All points of a tile go together, as columns, through the kernels of rays and of shading.
//
// * Snow is a flat layer of what lies below the point, along the normal (snow_layer.h): it reflects light
//   from before it and lets through, tinted, light from behind. Exact in the limit of a flat layer many
//   transport mean free paths thick that nothing lies behind; of curved snow it leaves out the light that
//   goes aside.
// * The edge of light and shade on round snow is softened over the angle by which light goes round in it.
// * Light from all around is that of one place (ambient.h), times v / (1 - R (1 - v)): of a hollow that is
//   open by v and reflects R all light that finds the way out. v is by the density before the surface.
// * Glints are those of sparkle.h, of suns and lamps; a sun's disc is taken as a whole, so they have no
// noise.
#pragma once
#include <cstdint>
#include <vector>

#include "src/render/columns/vector_columns.h"
#include "src/render/paths/path.h"
#include "src/render/preview/ambient.h"
#include "src/render/preview/preview_times.h"
#include "src/render/snow/snow_layer.h"

namespace firn {

class PreviewTile {
 public:
  PreviewTile(const View& view, const AmbientLight& ambient, const SnowLayers& layers);

  // Paints the tile's pixels in all layers of the picture; returns the number of rays traced.
  std::uint64_t trace(const Tile& tile, Picture& picture, PreviewTimes& times);

 private:
  struct Sight {  // a ray on its way
    std::uint32_t pixel;
    Vec3f weight;  // throughput
    float spread;  // m, of what the pixel sees 1 m away; 0: by way of a mirror
  };
  struct Point {  // where light is wanted
    std::uint32_t pixel;
    std::uint32_t sorted = kernels::kNoHit;  // of snow, its particle; of a surface yet unknown, kSurfaceHit
    std::uint32_t object = 0;                // of snow
    Vec3f p, back, smooth;                   // m; unit, towards the eye; unit, outward
    Vec3f weight;
    SurfacePoint surface;     // of snow, its normal has grain
    float footprint = 0;      // m, of a pixel; 0: seen by way of a mirror
    float lift = 0;           // m, that shadow rays start above the surface
    std::uint32_t group = 0;  // of points

    bool snow() const { return sorted != kernels::kNoHit; }
  };
  struct Group {  // of neighbouring points that see the same snow: those from `first` on
    std::uint32_t first, size;
    Vec3f p, normal;    // means
    float placed;       // kg/m^3, of the snow when it was placed
    float column = 0;   // kg/m^2, of the snow below
    float opening = 1;  // how much of the sky is seen
    float soft = 0;     // cosine over which light and shade meet
    float lift = 0;     // m, as Point has it
    SnowLayer layer;
  };
  struct End {  // of a column
    std::uint32_t group;
    float within, beyond;  // cells: the last probe that found snow, and the first that found none
    float counted;         // cells of snow that the column has by now
  };
  struct Brings {  // what a light adds to a point
    std::uint32_t point;
    Vec3f direct, passed;
    LightSample light;
    bool sunlit = false, glints = false;  // direct light arrives; facets may shine
  };

  void aim(const Tile& tile, bool layered);
  void find(bool first);
  void arrive(std::size_t ray, bool first);
  Point& add_point(const Sight& sight, float t, const Vec3f& p, const Vec3f& back);
  void go_on(std::size_t ray, const Sight& sight, const SurfacePoint& surface, const Vec3f& p);
  void find_normals();
  void find_grain();
  void note_first();

  void probe();
  void group_points();
  bool alike(const Point& point, const Point& other) const;
  const Group& group_of(const Point& point) const { return groups_[point.group]; }
  void measure_columns();
  void find_ends();
  void measure_openings();
  void prepare();
  void cast_shadows(int beacon);
  bool bring(const Point& point, Brings& brings) const;
  bool may_glint(const Point& point, const Vec3f& direction) const;
  void find_lit();
  void gather_particles();
  void find_glints();
  Vec3f glint(const Point& point, const LightSample& light) const;
  void add_lit();
  void add_ambient();
  void paint(Picture& picture) const;

  const View& view_;
  const AmbientLight& ambient_;
  const SnowLayers& layers_;
  const bool bare_;                    // there is nothing but snow, suns and sky
  std::vector<float> density_placed_;  // kg/m^3, per object
  std::uint64_t rays_traced_ = 0;
  // Per pixel of the tile: its light, its other layers (where the picture has any) and its place.
  std::vector<Vec3f> beauty_;
  std::vector<FilmSample> layered_;
  std::vector<std::int32_t> pixel_x_, pixel_y_;
  std::vector<float> spread_;
  RayStream rays_, next_rays_, shadow_rays_;
  std::vector<Sight> sights_, next_sights_;
  std::vector<ObjectHit> objects_;  // per ray, what it meets before the snow
  std::vector<Point> points_;
  std::vector<float> probe_from_[3], probe_up_[3], probe_down_[3], density_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> open_;  // groups whose columns go on
  std::vector<End> ends_;
  std::vector<Brings> brings_;
  // Columns over the points of snow, or over those of them that may glint.
  std::vector<std::uint32_t> snow_, gathered_;  // their places in points_ or brings_
  VectorColumns place_, local_, back_, smooth_, normal_, light_;
  std::vector<std::uint32_t> particle_, id_;
  std::vector<std::int16_t> turn_[3];
  std::vector<float> light_chord_, footprint_;
  std::vector<std::uint8_t> glints_;
};

}  // namespace firn
