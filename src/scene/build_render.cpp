// SPDX-License-Identifier: MIT
// In: a SceneConfig. Out: what the renderer is told: surfaces by number, objects, lights.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "firn/error.h"
#include "src/core/memory.h"
#include "src/scene/load_texture.h"
#include "src/scene/place_shape.h"
#include "src/scene/scene.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// What a pixel takes at the least, while one frame is made: its film and its picture.
constexpr double kBytesPerPixel = 48;

constexpr double kDegrees = 3.14159265358979323846 / 180;

int surface_number(const RenderSetup& setup, const std::string& name) {
  for (std::size_t i = 0; i < setup.surfaces.size(); ++i) {
    if (setup.surfaces[i].name == name) return static_cast<int>(i);
  }
  return 0;
}

QuadLight quad_light(const LightConfig& light) {
  if (light.corner) return {*light.corner, *light.edge_u, *light.edge_v, light.radiance};
  // A plane's frame has x cross y = z; the light shines along x cross -z = y.
  const Mat3 frame = plane_shape(*light.center, *light.direction).pose.rotation;
  const Vec3 u = frame.col(0) * *light.width, v = frame.col(2) * -*light.height;
  return {*light.center - 0.5 * (u + v), u, v, light.radiance};
}

Vec3 sun_direction(const LightConfig& light) {
  if (light.direction) return light.direction->normalized();
  const double azimuth = *light.azimuth * kDegrees, elevation = *light.elevation * kDegrees;
  return {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
          std::cos(elevation) * std::cos(azimuth)};
}

Light make_light(const SceneConfig& scene, std::size_t index) {
  const LightConfig& light = scene.lights[index];
  if (light.type == "quad") return quad_light(light);
  if (light.type == "sphere") return SphereLight{*light.center, *light.radius, light.radiance};
  if (light.type == "sun") return SunLight{sun_direction(light), light.angular_radius, light.irradiance};
  if (light.type == "sky") return SkyLight{light.zenith, light.horizon, light.ground};
  if (light.type == "day_sky") {
    const bool own = light.direction || light.azimuth;
    return DaySkyLight{sun_direction(own ? light : *first_sun(scene)), light.turbidity, light.scale,
                       light.ground};
  }
  if (light.type == "image") {
    const std::string table = table_of("light", index);
    return ImageLight{load_texture(scene, table, "file", *light.file), light.rotation, light.radiance};
  }
  return ConstantLight{light.radiance};
}

SnowLook snow_look(const SnowConfig& snow) {
  SnowLook look = snow.look;
  look.density = snow.material.density;
  look.extinction = snow_extinction(snow.grain_radius) / snow.scattering_depth;
  look.ice_per_collision = snow.tint * ice_per_collision(snow.grain_radius);
  return look;
}

// Before any is made: what pictures take at the very least.
void check_pixels(const SceneConfig& scene) {
  const double needed = kBytesPerPixel * scene.image.width * scene.image.height;
  const auto there = static_cast<double>(machine_memory());
  if (needed <= there) return;
  char text[160];
  std::snprintf(text, sizeof text, "%d x %d pixels need more than %.3g GiB; this machine has %.3g GiB",
                scene.image.width, scene.image.height, needed / kBytesPerGibibyte, there / kBytesPerGibibyte);
  throw Error(ErrorCode::usage, place_of(scene, "image", "width"), text);
}

void add_surfaces(const SceneConfig& scene, RenderSetup& setup) {
  setup.surfaces.push_back(Surface{});  // number 0: plain grey, for everything that names none
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const SurfaceConfig& config = scene.surfaces[i];
    setup.surfaces.push_back(config);
    if (!config.file) continue;
    const std::string table = table_of("surface", i);
    setup.surfaces.back().texture = load_texture(scene, table, "texture", *config.file);
  }
}

void place_objects(const SceneConfig& scene, RenderSetup& setup) {
  if (scene.ground) {
    setup.objects.push_back({plane_shape(Vec3(0, scene.ground->height, 0), Vec3::UnitY()),
                             surface_number(setup, scene.ground->surface),
                             {},
                             "the ground",
                             "ground"});
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const ColliderConfig& c = scene.colliders[i];
    if (!c.visible) continue;
    const Shape shape = place_shape(scene, table_of("collider", i), c.shape, ShapeUse::solid);
    setup.objects.push_back({shape, surface_number(setup, c.surface), place_motion(c, shape),
                             "collider '" + c.name + "'", c.name});
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const ObjectConfig& o = scene.objects[i];
    const std::string table = table_of("object", i);
    setup.objects.push_back(
        {place_shape(scene, table, o.shape, ShapeUse::solid), surface_number(setup, o.surface), {}, table});
  }
}

void place_media(const SceneConfig& scene, RenderSetup& setup) {
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    const MediumConfig& m = scene.media[i];
    const Shape shape = place_shape(scene, table_of("medium", i), m.shape, ShapeUse::solid);
    setup.media.push_back(
        {shape, m.thickness.value_or(INFINITY), m.sigma_s, m.sigma_a, static_cast<float>(m.g)});
  }
}

}  // namespace

RenderSetup build_render(const SceneConfig& scene) {
  check_pixels(scene);
  RenderSetup setup;
  setup.camera = scene.camera;
  setup.image = scene.image;
  setup.frame_seconds = scene.time.speed / scene.time.fps;
  setup.denoise = scene.output.denoise;
  for (const std::string& name : scene.output.layers) {
    const auto* found = std::find(std::begin(kLayerNames), std::end(kLayerNames), name);
    setup.layers.push_back(static_cast<Layer>(found - std::begin(kLayerNames)));
  }
  setup.seed = scene.simulation.seed;
  add_surfaces(scene, setup);
  place_objects(scene, setup);
  place_media(scene, setup);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) setup.lights.push_back(make_light(scene, i));
  for (const SnowConfig& snow : scene.snow) setup.snow.push_back(snow_look(snow));
  return setup;
}

}  // namespace firn
