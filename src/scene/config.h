// SPDX-License-Identifier: MIT
// A scene as it was written: plain aggregates with defaults, nested as the file is. schema.cpp lists every
// key once (name, type, unit, range, default, meaning); parse.cpp fills this; build.cpp turns it into the
// setups of mpm and render.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/core/vector.h"
#include "src/geometry/point_cloud.h"
#include "src/mpm/material.h"
#include "src/mpm/solver.h"
#include "src/render/setup.h"

namespace firn {

// A shape as keys: which of them are meant depends on `shape`.
struct ShapeConfig {
  std::string shape;                  // ball box cylinder capsule plane height_field mesh flakes particles
  std::optional<Vec3> center;         // ball box cylinder capsule flakes
  Vec3 offset = Vec3::Zero();         // mesh height_field particles, m
  std::optional<double> radius;       // ball cylinder capsule
  std::optional<Vec3> size;           // box: full edge lengths
  std::optional<double> height;       // cylinder capsule: full height
  Vec3 rotation = Vec3::Zero();       // degrees, about x, then y, then z
  std::optional<Vec3> point, normal;  // plane
  std::optional<std::string> file;    // mesh (OBJ), height_field (PGM or text raster), particles
  std::shared_ptr<const PointCloud> points;  // particles: arrays of a program in the place of a file
  double scale = 1;                          // mesh particles
  std::optional<double> spacing;             // particles: edge of the cube that each stands for, m
  std::optional<Vec3> extent;                // height_field: width (x), height range (y), depth (z)
  std::optional<double> base;                // height_field: its lower end, m
  int count = 1000;  // flakes: balls of `radius`, scattered in a box of `size` about `center`
};

struct SnowConfig {
  std::string name;
  ShapeConfig shape;
  Vec3 velocity = Vec3::Zero();             // m/s
  Vec3 spin = Vec3::Zero();                 // rad/s about the shape's centre
  std::optional<double> terminal_velocity;  // m/s
  std::optional<std::string> preset;
  Material material;
  std::optional<double> mu,
      lambda;  // Pa; as written, turned into Young's modulus and Poisson's ratio when read
  int particles_per_cell = 8;
  double looseness = 0;         // along the borders of clumps: Jp starts at 1 + looseness there
  double clump_size = 0.03;     // m
  bool allow_overlap = false;   // with other snow and with colliders at the start
  bool trim = false;            // starts without what would lie inside them
  double grain_radius = 1e-4;   // m, optical
  double scattering_depth = 1;  // times the mean free path
  double tint = 1;              // times the ice that light crosses
  SnowLook look;                // as written; build_render derives the rest
};

struct KeyFrameConfig {          // where a collider is at a time, from where its shape is written
  double time = 0;               // s
  Vec3 position = Vec3::Zero();  // m
  Vec3 rotation = Vec3::Zero();  // degrees, about x, then y, then z, about the pivot
};

struct ColliderConfig {
  std::string name;
  ShapeConfig shape;
  Contact contact = Contact::separating;
  double friction = 0.3;
  std::optional<double> static_friction;
  std::optional<std::vector<KeyFrameConfig>> motion;
  std::optional<Vec3> pivot;  // m
  std::string surface;        // name of a [[surface]]; empty: the default
  bool visible = true;
};

struct ObjectConfig {  // [[object]]: seen, not felt
  ShapeConfig shape;
  std::string surface;
};

struct GroundConfig {  // [ground]: a plane, felt and seen
  double height = 0;   // m
  Contact contact = Contact::separating;
  double friction = 0.5;
  std::optional<double> static_friction;
  std::string surface;
};

struct SurfaceConfig : Surface {
  std::optional<std::string> file;  // of its texture
};

struct LightConfig {                                   // [[light]]: which keys are meant depends on `type`
  std::string type;                                    // quad sphere sun sky day_sky image constant
  std::optional<Vec3> corner, edge_u, edge_v, center;  // m
  std::optional<double> width, height, radius;         // m
  std::optional<Vec3> direction;                       // quad: the way it shines; sun: towards the sun
  std::optional<double> azimuth, elevation;            // degrees
  double angular_radius = 0.2666;                      // degrees
  Vec3f irradiance = Vec3f(2.3f, 2.1f, 1.8f);
  Vec3f radiance = Vec3f::Constant(1.f);
  Vec3f zenith = Vec3f(0.13f, 0.25f, 0.55f);
  Vec3f horizon = Vec3f(0.45f, 0.55f, 0.7f);
  Vec3f ground = Vec3f(0.3f, 0.3f, 0.32f);
  double turbidity = 3;
  double scale = 0.02;              // W/(m^2 sr) per kcd/m^2
  std::optional<std::string> file;  // image
  double rotation = 0;              // degrees
};

struct MediumConfig {  // [[medium]]: homogeneous, in a convex shape
  ShapeConfig shape;
  std::optional<double> thickness;  // m, of a plane's
  Vec3f sigma_s = Vec3f::Ones();    // 1/m
  Vec3f sigma_a = Vec3f::Zero();    // 1/m
  double g = 0;
};

struct TimeConfig {
  int frames = 60;
  double fps = 24;
  double speed = 1;  // simulated seconds a movie second
};

struct SimulationConfig {
  std::optional<double> dx;             // m
  std::optional<int> particles_across;  // particles across the smallest snow object, instead of dx;
                                        // read_scene leaves one of the two
  std::optional<double> dt;             // s; absent: automatic
  Vec3 gravity = Vec3(0, -9.81, 0);
  std::optional<Vec3> domain_min, domain_max;  // m
  Vec3 domain_rotation = Vec3::Zero();         // degrees
  bool sleep = true;                           // leave out snow that has come to rest
  std::uint64_t seed = 1;
};

struct OutputConfig {
  std::vector<std::string> formats = {"png"};    // png ppm pfm exr
  std::vector<std::string> layers = {"beauty"};  // of pfm and exr files, names of enum Layer
  double exposure = 0;                           // stops
  ToneMap tone_map = ToneMap::soft;
  bool denoise = false;
  bool movie = true;
  bool particles = false;     // keep every frame's particles for `firn render RUN`
  int checkpoint_every = 10;  // frames; 0 = only when interrupted
};

struct SceneConfig {
  std::string file;  // path it was read from
  std::string name;  // file stem unless given: names the output folder
  std::string description;
  Camera camera;
  ImageSettings image;
  TimeConfig time;
  SimulationConfig simulation;
  std::vector<SnowConfig> snow;
  std::optional<GroundConfig> ground;
  std::vector<ColliderConfig> colliders;
  std::vector<ObjectConfig> objects;
  std::vector<MediumConfig> media;
  std::vector<LightConfig> lights;  // none: a sun and a sky
  std::vector<SurfaceConfig> surfaces;
  OutputConfig output;
  // "snow[0].radius" -> "scene.toml:12:3" for every key and table that was written, for errors found later.
  std::map<std::string, std::string> places;
};

}  // namespace firn
