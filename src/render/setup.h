// SPDX-License-Identifier: MIT
// What the renderer is told once for a run: camera, film, surfaces, objects, lights and the look of each snow
// object. World space, SI units; radiance in W/(m^2 sr) up to a common scale (exposure maps it to pixels).
#pragma once
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "src/core/vector.h"
#include "src/geometry/keyframes.h"
#include "src/geometry/shape.h"
#include "src/render/ice.h"

namespace firn {

struct Camera {
  Vec3 position = Vec3(0, 1, 4);  // m
  Vec3 target = Vec3::Zero();     // m
  Vec3 up = Vec3(0, 1, 0);
  double fov = 35;  // degrees, vertical
};

// What of the snow a ray meets: an implicit surface of the particles, or each as a ball.
enum class SnowShape { smooth, spheres };

struct ImageSettings {
  int width = 960;
  int height = 540;
  int samples = 16;     // paths a pixel
  int max_bounces = 6;  // surface interactions after the first hit; 0 = direct light only
  SnowShape snow = SnowShape::smooth;
  int detail = 1;                     // particles are drawn as detail^3 each: src/render/relief.h
  IceSource ice = IceSource::picard;  // of all snow: a path sums up its ice and asks once for the tint
};

enum class SurfaceKind { diffuse, mirror, emission };
struct Surface {
  std::string name;
  SurfaceKind kind = SurfaceKind::diffuse;
  Vec3f albedo = Vec3f::Constant(0.5f);   // linear RGB reflectance, diffuse and mirror
  Vec3f checker = Vec3f::Constant(-1.f);  // second albedo of a checker pattern; negative: none
  double checker_size = 0.1;              // m
  Vec3f emission = Vec3f::Zero();         // radiance
};

struct Object {  // colliders, ground and scenery: anything that is seen but is not snow
  Shape shape;
  int surface = 0;     // index into RenderSetup::surfaces
  Motion motion = {};  // of `shape`, by the snapshot's time
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
struct ConstantLight {
  Vec3f radiance;
};
using Light = std::variant<QuadLight, SphereLight, SunLight, SkyLight, ConstantLight>;

// The facets of ice that glint in the light of a snow object: src/render/sparkle.h.
struct SparkleSettings {
  double density = 0;     // facets per m^2 of surface; 0: none
  double size = 0.25e-3;  // m, radius of a facet
  double roughness = 3;   // degrees: its normals fill a cone of this half-angle
  double strength = 1;    // of the glints; 1 is what ice reflects
};

struct SnowLook {                             // one per snow object
  Vec3f albedo = Vec3f(0.93f, 0.95f, 0.97f);  // diffuse, linear RGB
  double radius = 0.8;   // of a drawn particle, in particle spacings (cbrt of its volume)
  double density = 400;  // kg/m^3, as placed
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
  std::vector<SnowLook> snow;  // index = Snapshot::object
  std::uint64_t seed = 1;
};

}  // namespace firn
