// SPDX-License-Identifier: MIT
// What the renderer is told once for a run: camera, film, surfaces, objects, lights and the look of each snow
// object. World space, SI units; radiance in W/(m^2 sr) up to a common scale (exposure maps it to pixels).
#pragma once
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firn/picture.h"
#include "src/core/vector.h"
#include "src/geometry/keyframes.h"
#include "src/geometry/shape.h"
#include "src/render/snow/ice.h"
#include "src/render/solids/image_texture.h"

namespace firn {

struct CameraKey {                                      // where the camera is at a time, and what it looks at
  double time = 0;                                      // s, simulated
  Vec3 position = Vec3::Zero(), target = Vec3::Zero();  // m
};

struct Camera {
  Vec3 position = Vec3(0, 1, 4);  // m
  Vec3 target = Vec3::Zero();     // m
  Vec3 up = Vec3(0, 1, 0);
  double fov = 35;                   // degrees, vertical
  double aperture = 0;               // m, radius of the lens; 0: all is sharp
  std::optional<double> focus = {};  // m along the line of sight; absent: the target's distance
  double shutter = 0;                // open for this part of the time between frames; 0: a moment
  std::optional<std::vector<CameraKey>> motion = {};  // in ascending order of time; beats position and target
};

// What of the snow a ray meets: an implicit surface of the particles, or each as a ball.
enum class SnowShape { smooth, spheres };

// Which ways of finding light there are (path.h); for speed, estimates in their place (preview.h); or
// whichever of the first three does best (pilot.h).
enum class Integrator { bidirectional, path, light, preview, automatic };
inline constexpr const char* kIntegratorNames[] = {"bidirectional", "path", "light", "preview", "auto"};
constexpr const char* name_of(Integrator integrator) {
  return kIntegratorNames[static_cast<int>(integrator)];
}
enum class SamplerKind { sobol, independent };

// Where the snow's light scatters: inside of it, by the equations; or, for speed, where it comes upon the
// snow, which then is a matt surface as bright as deep snow of its grain.
enum class SnowLight { inside, surface };

enum class FilterKind { box, tent, gaussian, blackman_harris };

struct ImageSettings {
  int width = 960;
  int height = 540;
  int samples = 16;  // paths a pixel
  // Scatterings of an eye subpath after the first; 0: direct light only. Roulette ends paths, so snow needs
  // no limit.
  int max_bounces = 1000000;
  int light_bounces = 5;  // scatterings of a light subpath
  Integrator integrator = Integrator::path;
  SamplerKind sampler = SamplerKind::sobol;
  bool reference = false;  // nothing but the equations: no similarity in the snow
  SnowShape snow = SnowShape::smooth;
  SnowLight snow_light = SnowLight::surface;
  FilterKind filter = FilterKind::tent;
  std::optional<double> filter_width = {};  // pixels from end to end; absent: as filter.h has it
  double noise = 0;                   // relative error at which a pixel is done; 0: it takes all samples
  int motion_slices = 4;              // moments that a frame with an open shutter is put together from
  int detail = 1;                     // particles are drawn as detail^3 each: src/render/snow/relief.h
  IceSource ice = IceSource::picard;  // of all snow: a path sums up its ice and asks once for the tint
};

// none: no surface at all, rays go through; where a medium ends whose index is that of its surroundings.
enum class SurfaceKind { diffuse, mirror, glossy, dielectric, emission, none };
struct Surface {
  std::string name;
  SurfaceKind kind = SurfaceKind::diffuse;
  Vec3f albedo = Vec3f::Constant(0.5f);  // linear RGB reflectance; glossy: at normal incidence
  double roughness = 0.3;                // glossy: the root of GGX's alpha
  double ior = 1.5;  // dielectric: refractive index behind the surface over that before it
  Vec3f checker = Vec3f::Constant(-1.f);        // second albedo of a checker pattern; negative: none
  double checker_size = 0.1;                    // m
  std::shared_ptr<const ImageTexture> texture;  // instead of the albedo, repeated over the surface
  double texture_size = 1;                      // m, its width
  Vec3f emission = Vec3f::Zero();               // radiance
};

struct Object {  // colliders, ground and scenery: anything that is seen but is not snow
  Shape shape;
  int surface = 0;            // index into RenderSetup::surfaces
  Motion motion = {};         // of `shape`, by the snapshot's time
  std::string name = {};      // for people
  std::string collider = {};  // what a driven collider is called that it is; empty: none
};

struct QuadLight {
  Vec3 corner, edge_u, edge_v;  // m; it shines to the side of edge_u x edge_v
  Vec3f radiance;
};
struct SphereLight {
  Vec3 center;
  double radius;  // m
  Vec3f radiance;
};
struct SunLight {
  Vec3 direction;                  // towards the sun, any length
  double angular_radius = 0.2666;  // degrees
  Vec3f irradiance;                // on a plane facing the sun
};
struct SkyLight {
  Vec3f zenith, horizon, ground;  // radiance; smooth gradient over elevation
};
struct DaySkyLight {             // a clear sky by Preetham, Shirley, Smits 1999
  Vec3 sun = Vec3::UnitY();      // towards it, any length; above the horizon
  double turbidity = 3;          // haze: 2 very clear, 3 clear, 6 and more hazy
  double scale = 0.02;           // radiance per kcd/m^2
  Vec3f ground = Vec3f::Zero();  // radiance below the horizon
};
struct ImageLight {                             // a picture of all directions, latitude over longitude
  std::shared_ptr<const ImageTexture> picture;  // top row up, middle column towards -Z, right of it +X
  double rotation = 0;                          // degrees about +Y
  Vec3f radiance = Vec3f::Ones();               // of a pixel of 1
};
struct ConstantLight {
  Vec3f radiance;
};
using Light =
    std::variant<QuadLight, SphereLight, SunLight, SkyLight, DaySkyLight, ImageLight, ConstantLight>;

struct Medium {  // homogeneous, within a convex shape: ball, box, cylinder, capsule, plane (what lies below
                 // it)
  Shape shape;
  double thickness = INFINITY;    // m, of a plane's: a slab
  Vec3f sigma_s = Vec3f::Ones();  // 1/m, scattering
  Vec3f sigma_a = Vec3f::Zero();  // 1/m, absorption
  float g = 0;                    // mean cosine of a scattering (Henyey-Greenstein)
};

// The facets of ice that glint in the light of a snow object: src/render/snow/sparkle.h.
struct SparkleSettings {
  double density = 0;     // facets per m^2 of surface; 0: none
  double size = 0.25e-3;  // m, radius of a facet
  double roughness = 3;   // degrees: its normals fill a cone of this half-angle
  double strength = 1;    // of the glints; 1 is what ice reflects
};

struct SnowLook {                // one per snow object
  Vec3f albedo = Vec3f::Ones();  // reflectance when deep, besides what the ice absorbs: dirt, sand
  double radius = 0.8;           // of a drawn particle, in particle spacings (cbrt of its volume)
  double density = 400;          // kg/m^3, as placed
  double extinction = snow_extinction(1e-4);                 // m^2/kg: sigma_t per density
  double anisotropy = kNaturalAnisotropy;                    // g of Henyey and Greenstein
  double ice_per_collision = firn::ice_per_collision(1e-4);  // m
  SparkleSettings sparkle;
};

struct RenderSetup {
  Camera camera;
  ImageSettings image;
  std::vector<Surface> surfaces;
  std::vector<Object> objects;
  std::vector<Light> lights;
  std::vector<Medium> media;
  std::vector<SnowLook> snow;  // index = Snapshot::object
  std::uint64_t seed = 1;
  std::vector<Layer> layers;  // kept of each picture beside its beauty
  bool denoise = false;
  double frame_seconds = 1.0 / 24;  // simulated, from one frame to the next
};

}  // namespace firn
