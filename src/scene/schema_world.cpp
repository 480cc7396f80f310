// SPDX-License-Identifier: MIT
// What a scene says about the world: time, the simulation, the snow and what it meets.
#include "src/scene/presets.h"
#include "src/scene/schema_tables.h"

namespace firn {
namespace {

const std::vector<std::string> kContacts = {"sticky", "slip", "separating"};  // in the order of enum Contact
const char* const kContactMeaning =
    "sticky: snow that touches stays; slip: slides but never leaves; separating: leaves freely";

TableSpec top_level() {
  auto t = single_table<SceneConfig>("", "the top level of the file",
                                     [](SceneConfig& s, std::size_t) -> SceneConfig& { return s; });
  t.key("name", &SceneConfig::name, {.absent = "the file's name", .meaning = "names the output folder"});
  t.key("description", &SceneConfig::description, {.meaning = "what the scene shows, for people"});
  return t.take();
}

TableSpec time_table() {
  auto t = single_table<TimeConfig>("time",
                                    "frame k shows the simulated time k * speed / fps; frame 0 is the start",
                                    [](SceneConfig& s, std::size_t) -> TimeConfig& { return s.time; });
  t.key("frames", &TimeConfig::frames,
        {.range = between(1, 1000000), .meaning = "pictures in all, the first included"});
  t.key("fps", &TimeConfig::fps,
        {.unit = "1/s", .range = above(0), .meaning = "pictures a second of the movie"});
  t.key("speed", &TimeConfig::speed,
        {.range = above(0), .meaning = "simulated seconds a second of the movie; below 1 is slow motion"});
  return t.take();
}

TableSpec simulation_table() {
  using S = SimulationConfig;
  auto t = single_table<S>("simulation", "how finely and where the snow is computed",
                           [](SceneConfig& s, std::size_t) -> S& { return s.simulation; });
  t.key("dx", &S::dx,
        {.unit = "m", .range = above(0), .absent = "from particles_across", .meaning = "grid spacing"});
  t.key("particles_across", &S::particles_across,
        {.range = between(2, 100000),
         .absent = "40, unless dx is given",
         .meaning = "particles across the smallest snow object, instead of dx; without a meaning where snow "
                    "is made of points"});
  t.key("dt", &S::dt,
        {.unit = "s",
         .range = above(0),
         .absent = "auto",
         .absent_word = "auto",
         .meaning = "a fixed time step; auto follows the stiffest and the fastest snow"});
  t.key("gravity", &S::gravity, {.unit = "m/s^2", .meaning = "acceleration of everything"});
  t.key("domain_min", &S::domain_min,
        {.unit = "m", .absent = "no box", .meaning = "lower corner of a box; snow that leaves it is gone"});
  t.key("domain_max", &S::domain_max,
        {.unit = "m", .absent = "no box", .meaning = "upper corner of that box"});
  t.key("domain_rotation", &S::domain_rotation,
        {.unit = "degrees",
         .meaning = "turns that box about x, then y, then z, about its centre, and the grid with it"});
  t.key("sleep", &S::sleep,
        {.meaning = "leave out blocks of snow that have come to rest, until something moves beside them"});
  t.key("seed", &S::seed,
        {.range = at_least(0), .meaning = "of everything random: the same seed gives the same bits"});
  return t.take();
}

void add_material_keys(TableBuilder<SnowConfig>& t) {
  const auto part = [](auto member) {
    return [member](SnowConfig & s) -> auto& { return s.material.*member; };
  };
  const Condition snow{"model", {"snow"}}, neo_hookean{"model", {"neo_hookean"}},
      grains{"model", {"drucker_prager"}}, clay{"model", {"cam_clay"}},
      hardens{"model", {"snow", "cam_clay"}}, rubs{"model", {"drucker_prager", "cam_clay"}};
  t.key("model", part(&Material::model),
        {.choices = {std::begin(kernels::AllMaterials::kNames), std::end(kernels::AllMaterials::kNames)},
         .meaning = "snow: fixed corotated with hardening (Stomakhin et al. 2013); neo_hookean: with clamped "
                    "stretches; drucker_prager: grains with friction (Klar et al. 2016); "
                    "cam_clay: snow that crushes, shears and sticks (Gaume et al. 2018)"});
  t.key("density", part(&Material::density), {.unit = "kg/m^3", .range = above(0), .meaning = "as placed"});
  t.key("young_modulus", part(&Material::young_modulus),
        {.unit = "Pa", .range = above(0), .meaning = "stiffness under pull, unhardened"});
  t.key("poisson_ratio", part(&Material::poisson_ratio),
        {.range = {0, 0.5, false, true}, .meaning = "how much it widens when pressed"});
  t.key("mu", &SnowConfig::mu,
        {.unit = "Pa",
         .range = above(0),
         .absent = "from young_modulus and poisson_ratio",
         .meaning = "shear modulus, together with lambda instead of young_modulus and poisson_ratio"});
  t.key("lambda", &SnowConfig::lambda,
        {.unit = "Pa",
         .range = at_least(0),
         .absent = "from young_modulus and poisson_ratio",
         .meaning = "first Lame modulus, together with mu"});
  t.key("plasticity", part(&Material::plasticity), {.meaning = "false: elastic, nothing breaks or packs"});
  t.key("critical_compression", part(&Material::critical_compression),
        {.range = {0, 1, true, true}, .with = snow, .meaning = "theta_c: compression at which snow yields"});
  t.key("critical_stretch", part(&Material::critical_stretch),
        {.range = {0, 1, true, true}, .with = snow, .meaning = "theta_s: stretch at which snow breaks"});
  t.key("hardening", part(&Material::hardening),
        {.range = between(0, 100),
         .with = hardens,
         .meaning = "xi: packed snow is stiffer by exp(xi (1 - Jp)); cam_clay: stronger, p0 grows with "
                    "sinh(xi times compaction)"});
  t.key("jp_min", part(&Material::jp_min),
        {.range = {0, 1, true, false},
         .with = snow,
         .meaning = "least plastic volume ratio Jp: hardest packing"});
  t.key("jp_max", part(&Material::jp_max),
        {.range = at_least(1), .with = snow, .meaning = "greatest plastic volume ratio Jp: loosest snow"});
  t.key("sigma_min", part(&Material::sigma_min),
        {.range = {0, 1, true, false}, .with = neo_hookean, .meaning = "least singular value of F"});
  t.key("sigma_max", part(&Material::sigma_max),
        {.range = at_least(1), .with = neo_hookean, .meaning = "greatest singular value of F"});
  t.key("friction_angle", part(&Material::friction_angle),
        {.unit = "degrees",
         .range = {0, 90, false, true},
         .with = rubs,
         .meaning = "of grains on grains: about the slope at which they rest"});
  t.key("cohesion", part(&Material::cohesion),
        {.range = between(0, 1),
         .with = grains,
         .meaning = "logarithm of the even stretch at which grains part; 0: none, they are dry"});
  t.key("compressive_strength", part(&Material::compressive_strength),
        {.unit = "Pa",
         .range = above(0),
         .with = clay,
         .meaning = "p0: even pressure at which it crushes, at the start"});
  t.key("cohesion_ratio", part(&Material::cohesion_ratio),
        {.range = between(0, 1), .with = clay, .meaning = "beta: tensile over compressive strength"});
  t.key("collapse", part(&Material::collapse),
        {.range = between(0, 0.4),
         .with = clay,
         .meaning = "weak layer: softens however it yields, loses its cohesion and closes by this "
                    "logarithmic strain before it bears again; 0: it does not"});
}

void add_look_keys(TableBuilder<SnowConfig>& t) {
  const auto look = [](auto member) {
    return [member](SnowConfig & s) -> auto& { return s.look.*member; };
  };
  t.key("albedo", look(&SnowLook::albedo),
        {.range = between(0, 1),
         .meaning = "reflectance of a deep layer besides what the ice absorbs, linear RGB: 1 for snow, less "
                    "for dirt or sand"});
  t.key(
      "draw_radius", look(&SnowLook::radius),
      {.unit = "spacings", .range = between(0.1, 4), .meaning = "of a drawn particle, in particle spacings"});
  t.key("grain_radius", &SnowConfig::grain_radius,
        {.unit = "m",
         .range = between(1e-5, 1e-2),
         .meaning =
             "optical radius of the grains, 3 / (917 kg/m^3 x specific surface): light goes deeper in coarse "
             "snow and comes out bluer and darker"});
  t.key("anisotropy", look(&SnowLook::anisotropy),
        {.range = {-1, 1, true, true},
         .meaning = "g, the mean cosine of scattering: 0.845 natural grains, 0.89 spheres"});
  t.key("scattering_depth", &SnowConfig::scattering_depth,
        {.range = above(0),
         .meaning = "stretches the way of light between two grains, and so the depth of its walk, not the "
                    "colour; 1 is "
                    "physics"});
  t.key("tint", &SnowConfig::tint,
        {.range = at_least(0),
         .meaning = "strength of the ice's absorption, and so of the blue; 1 is physics"});
  const auto sparkle = [](auto member) {
    return [member](SnowConfig & s) -> auto& { return s.look.sparkle.*member; };
  };
  t.key("sparkle", sparkle(&SparkleSettings::density),
        {.unit = "1/m^2",
         .range = at_least(0),
         .meaning = "facets of ice on the surface that may glint: some 4e6 on fresh snow; 0: none"});
  t.key("sparkle_size", sparkle(&SparkleSettings::size),
        {.unit = "m", .range = above(0), .meaning = "radius of a facet: larger glints are brighter"});
  t.key("sparkle_roughness", sparkle(&SparkleSettings::roughness),
        {.unit = "degrees",
         .range = {0, 45, true, false},
         .meaning = "half-angle of the cone of a facet's normals: wider glints are more and dimmer"});
  t.key("sparkle_strength", sparkle(&SparkleSettings::strength),
        {.range = at_least(0), .meaning = "brightness of the glints; 1 is physics"});
}

TableSpec snow_table() {
  auto t = repeated_table<&SceneConfig::snow>("snow", "one body of snow");
  t.key(
      "name", &SnowConfig::name,
      {.absent = "snow0, snow1, ...", .meaning = "for messages, --set snow.NAME.key and [quick.snow.NAME]"});
  add_shape_keys(t, {"ball", "box", "cylinder", "capsule", "height_field", "mesh", "flakes", "particles"});
  t.key("count", [](SnowConfig & s) -> auto& { return s.shape.count; },
        {.range = between(1, 10000000),
         .with = {"shape", {"flakes"}},
         .meaning = "flakes: small balls of snow scattered in the region, apart from one another"});
  t.key("spacing", [](SnowConfig & s) -> auto& { return s.shape.spacing; },
        {.unit = "m",
         .range = above(0),
         .with = {"shape", {"particles"}},
         .absent = "from the file, or else from how densely its points lie",
         .meaning = "edge of the cube of snow that each point stands for"});
  t.key("velocity", &SnowConfig::velocity,
        {.unit = "m/s", .meaning = "at the start; added to that of a file's points"});
  t.key("spin", &SnowConfig::spin, {.unit = "rad/s", .meaning = "at the start, about the shape's centre"});
  t.key(
      "terminal_velocity", &SnowConfig::terminal_velocity,
      {.unit = "m/s",
       .range = above(0),
       .absent = "no air",
       .meaning = "speed at which the drag of still air carries its weight, of every particle as if it flew "
                  "alone: about 1 for flakes, 30 for a ball as large as a fist"});
  KeySpec& preset = t.key("preset", &SnowConfig::preset,
                          {.choices = preset_names(),
                           .absent = "fresh",
                           .meaning = "material to start from; other keys beat it"});
  preset.set = [write = preset.set](SceneConfig& scene, std::size_t index, const KeyValue& value) {
    write(scene, index, value);
    const Preset& named = find_preset(std::get<std::string>(value));
    scene.snow[index].material = named.material;
    scene.snow[index].grain_radius = named.grain_radius;
  };
  add_material_keys(t);
  t.key("particles_per_cell", &SnowConfig::particles_per_cell,
        {.range = between(1, 1000), .meaning = "8 is usual; fewer tear earlier, more cost time"});
  t.key("looseness", &SnowConfig::looseness,
        {.range = between(0, 1),
         .meaning = "0: even; above: seams between clumps start with Jp = 1 + looseness, where the snow "
                    "breaks first"});
  t.key("clump_size", &SnowConfig::clump_size,
        {.unit = "m", .range = above(0), .meaning = "mean distance of clumps"});
  t.key("allow_overlap", &SnowConfig::allow_overlap,
        {.meaning = "start inside other snow or a collider without an error"});
  t.key("trim", &SnowConfig::trim,
        {.meaning = "start without what lies inside colliders and other snow; of two that are trimmed the "
                    "earlier keeps it"});
  add_look_keys(t);
  return t.take();
}

template <class Record>
void add_friction_keys(TableBuilder<Record>& t) {
  t.key("friction", &Record::friction,
        {.range = at_least(0), .meaning = "Coulomb coefficient of snow that slides"});
  t.key("static_friction", &Record::static_friction,
        {.range = at_least(0),
         .absent = "as friction",
         .meaning = "Coulomb coefficient of snow that stands, not below friction"});
}

TableSpec ground_table() {
  using G = GroundConfig;
  TableBuilder<G> t({"ground",
                     false,
                     "a level plane without end, felt and seen",
                     {},
                     [](const SceneConfig& s) { return std::size_t{s.ground.has_value()}; },
                     [](SceneConfig& s) { s.ground.emplace(); }},
                    [](SceneConfig& s, std::size_t) -> G& { return *s.ground; });
  t.key("height", &G::height, {.unit = "m", .meaning = "y of the plane"});
  t.key("contact", &G::contact, {.choices = kContacts, .meaning = kContactMeaning});
  add_friction_keys(t);
  t.key("surface", &G::surface, {.absent = "plain grey", .meaning = "name of a [[surface]]"});
  return t.take();
}

TableSpec collider_table() {
  using C = ColliderConfig;
  auto t = repeated_table<&SceneConfig::colliders>(
      "collider", "a solid, felt and seen; it stands still unless it has a motion");
  t.key("name", &C::name, {.absent = "collider0, collider1, ...", .meaning = "for messages and --set"});
  add_shape_keys(t, {"ball", "box", "cylinder", "capsule", "plane", "height_field", "mesh"});
  add_plane_keys(t);
  t.key("contact", &C::contact, {.choices = kContacts, .meaning = kContactMeaning});
  add_friction_keys(t);
  t.key("motion", &C::motion,
        {.unit = "s, m, degrees",
         .absent = "it stands still",
         .meaning =
             "key frames: at `time` of the simulation the shape is shifted by `position` from where it is "
             "written and turned by `rotation` about the pivot's x, then y, then z; straight and even "
             "between keys, at rest before the first and after the last"});
  t.key("pivot", &C::pivot,
        {.unit = "m",
         .absent = "the shape's centre",
         .meaning = "what the motion's rotations turn about, before any shift"});
  t.key("surface", &C::surface, {.absent = "plain grey", .meaning = "name of a [[surface]]"});
  t.key("visible", &C::visible, {.meaning = "false: felt but not seen"});
  return t.take();
}

}  // namespace

std::vector<TableSpec> world_tables() {
  return {top_level(), time_table(), simulation_table(), snow_table(), ground_table(), collider_table()};
}

}  // namespace firn
