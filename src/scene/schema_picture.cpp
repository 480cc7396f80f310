// SPDX-License-Identifier: MIT
// What a scene says about its pictures: camera, image, things that are only seen, lights, surfaces and the
// output.
#include <iterator>

#include "src/scene/schema_tables.h"

namespace firn {
namespace {

const char* const kRadiance = "W/(m^2 sr)";

TableSpec camera_table() {
  auto t = single_table<Camera>("camera", "where the picture is taken from",
                                [](SceneConfig& s, std::size_t) -> Camera& { return s.camera; });
  t.key("position", &Camera::position, {.unit = "m", .meaning = "of the eye"});
  t.key("target", &Camera::target, {.unit = "m", .meaning = "what is in the middle of the picture"});
  t.key("up", &Camera::up, {.meaning = "this direction is up in the picture"});
  t.key("fov", &Camera::fov,
        {.unit = "degrees", .range = {0, 180, true, true}, .meaning = "vertical field of view"});
  t.key("aperture", &Camera::aperture,
        {.unit = "m",
         .range = at_least(0),
         .meaning = "radius of the lens: what is not in focus is blurred by it; 0: all is sharp"});
  t.key("focus", &Camera::focus,
        {.unit = "m",
         .range = above(0),
         .absent = "the target's distance",
         .meaning = "distance along the line of sight of the plane that is sharp"});
  t.key("shutter", &Camera::shutter,
        {.range = between(0, 1),
         .meaning = "part of the time between two frames that the shutter is open, about the frame's time: "
                    "what moves is blurred; 0: a moment"});
  t.key(
      "motion", &Camera::motion,
      {.unit = "s, m",
       .absent = "it stands still",
       .meaning = "key frames, instead of position and target: at `time` of the simulation the camera is at "
                  "`position` and looks at `target`; straight and even between keys, at rest before the "
                  "first and after the last"});
  return t.take();
}

TableSpec image_table() {
  using I = ImageSettings;
  auto t = single_table<I>("image", "size and quality of the pictures",
                           [](SceneConfig& s, std::size_t) -> I& { return s.image; });
  t.key("width", &I::width, {.unit = "pixels", .range = between(1, 32768), .meaning = "of the picture"});
  t.key("height", &I::height, {.unit = "pixels", .range = between(1, 32768), .meaning = "of the picture"});
  t.key("samples", &I::samples,
        {.range = between(1, 1000000), .meaning = "paths a pixel: more is less noise"});
  t.key(
      "noise", &I::noise,
      {.range = between(0, 1),
       .meaning = "relative error at which a pixel is done before it has taken all samples (at least 16); 0: "
                  "none is"});
  t.key("filter", &I::filter,
        {.choices = {"box", "tent", "gaussian", "blackman_harris"},  // in the order of enum FilterKind
         .meaning = "how a pixel weighs the light about its centre"});
  t.key("filter_width", &I::filter_width,
        {.unit = "pixels",
         .range = {0, 16, true, false},
         .absent = "1 for box, 2 for tent, 3 for the others",
         .meaning = "from end to end"});
  t.key("motion_slices", &I::motion_slices,
        {.range = between(1, 1000),
         .meaning = "moments that the blur of an open shutter is put together from; the snow is gridded anew "
                    "for each"});
  t.key("snow", &I::snow,
        {.choices = {"smooth", "spheres"},
         .meaning =
             "what of the snow is seen: a smooth surface around the particles, or each of them as a ball"});
  t.key(
      "integrator", &I::integrator,
      {.choices = {std::begin(kIntegratorNames), std::end(kIntegratorNames)},
       .meaning =
           "how light is found: from the camera and from the lights, from the camera alone, from the "
           "lights alone (which cannot see what is behind a mirror); preview: estimates without noise, "
           "many frames a second: one ray through the middle of a pixel, so that samples, bounces, "
           "snow_light, lens, shutter and denoise do not count; auto: whichever of the first three needs the "
           "least work for the same error, found for each frame by small pictures"});
  t.key(
      "snow_light", &I::snow_light,
      {.choices = {"inside", "surface"},
       .meaning =
           "inside: light walks through the snow, with its blue and its glow; surface: it is reflected where "
           "it comes upon the snow, as brightly as by a deep layer, some fifty times faster"});
  t.key(
      "max_bounces", &I::max_bounces,
      {.range = between(0, 1000000),
       .meaning = "scatterings after the first, from the camera; 0 is direct light only. Light that fades is "
                  "ended by chance, so snow needs no limit"});
  t.key("light_bounces", &I::light_bounces,
        {.range = between(1, 15),
         .meaning = "scatterings of light on its way from a lamp, unless integrator = path"});
  t.key("sampler", &I::sampler,
        {.choices = {"sobol", "independent"},
         .meaning = "random numbers: spread evenly over the samples of a pixel, or each for itself"});
  t.key("reference", &I::reference,
        {.meaning = "nothing but the equations: every collision in the snow is followed with its true phase "
                    "function"});
  t.key("detail", &I::detail,
        {.range = between(1, 6),
         .meaning = "close-ups: each particle is drawn as detail^3 smaller ones that move and turn with it, "
                    "for relief "
                    "and grain below its size; takes the memory of so many particles"});
  t.key("ice", &I::ice,
        {.choices = {"picard", "warren_brandt"},
         .meaning = "measured absorption of ice: Picard et al. 2016, natural snow; Warren and Brandt 2008, "
                    "the cleanest, "
                    "7 times clearer in the blue"});
  return t.take();
}

TableSpec object_table() {
  auto t = repeated_table<&SceneConfig::objects>("object", "scenery: seen, not felt");
  add_shape_keys(t, {"ball", "box", "cylinder", "capsule", "plane", "height_field", "mesh"});
  add_plane_keys(t);
  t.key("surface", &ObjectConfig::surface, {.absent = "plain grey", .meaning = "name of a [[surface]]"});
  return t.take();
}

TableSpec medium_table() {
  using M = MediumConfig;
  auto t = repeated_table<&SceneConfig::media>(
      "medium", "a homogeneous medium that light scatters in: fog, milk; where two overlap, they add");
  add_shape_keys(t, {"ball", "box", "cylinder", "capsule", "plane"});
  add_plane_keys(t);
  t.key("thickness", &M::thickness,
        {.unit = "m",
         .range = above(0),
         .with = {"shape", {"plane"}},
         .absent = "without end",
         .meaning = "of the slab below the plane"});
  t.key("sigma_s", &M::sigma_s,
        {.unit = "1/m", .range = at_least(0), .meaning = "scattering coefficient, linear RGB"});
  t.key("sigma_a", &M::sigma_a,
        {.unit = "1/m", .range = at_least(0), .meaning = "absorption coefficient, linear RGB"});
  t.key("g", &M::g,
        {.range = {-1, 1, true, true},
         .meaning = "mean cosine of a scattering: 0 alike to all sides, towards 1 ahead"});
  return t.take();
}

void add_quad_keys(TableBuilder<LightConfig>& t) {
  using L = LightConfig;
  const Condition quad{"type", {"quad"}};
  t.key("corner", &L::corner,
        {.unit = "m", .with = quad, .absent = "from center", .meaning = "a corner; with edge_u and edge_v"});
  t.key("edge_u", &L::edge_u,
        {.unit = "m", .with = quad, .absent = "from center", .meaning = "one side, from the corner"});
  t.key("edge_v", &L::edge_v,
        {.unit = "m",
         .with = quad,
         .absent = "from center",
         .meaning = "the other side; it shines along edge_u x edge_v"});
  t.key("width", &L::width,
        {.unit = "m",
         .range = above(0),
         .with = quad,
         .absent = "from the edges",
         .meaning = "instead of the edges: with center, height and direction"});
  t.key("height", &L::height,
        {.unit = "m",
         .range = above(0),
         .with = quad,
         .absent = "from the edges",
         .meaning = "of such a quad"});
}

TableSpec light_table() {
  using L = LightConfig;
  auto t = repeated_table<&SceneConfig::lights>("light",
                                                "a light; without any there are a low sun and a blue sky");
  t.key(
      "type", &L::type,
      {.choices = {"quad", "sphere", "sun", "sky", "day_sky", "image", "constant"},
       .required = true,
       .meaning =
           "what it is; sky: a gradient; day_sky: a clear sky by the sun's height (Preetham, Shirley, Smits "
           "1999); image: a picture of all directions"});
  add_quad_keys(t);
  t.key("center", &L::center,
        {.unit = "m",
         .with = {"type", {"quad", "sphere"}},
         .absent = "a quad's from its corner",
         .meaning = "its middle"});
  t.key("radius", &L::radius,
        {.unit = "m",
         .range = above(0),
         .with = {"type", {"sphere"}},
         .required = true,
         .meaning = "of the sphere"});
  t.key("direction", &L::direction,
        {.with = {"type", {"quad", "sun", "day_sky"}},
         .absent = "from the edges; from azimuth and elevation",
         .meaning = "quad: the way it shines; sun, day_sky: towards the sun; any length"});
  t.key("azimuth", &L::azimuth,
        {.unit = "degrees",
         .with = {"type", {"sun", "day_sky"}},
         .absent = "from direction; day_sky: from the scene's sun",
         .meaning = "of the sun: from +Z, turning towards +X"});
  t.key("elevation", &L::elevation,
        {.unit = "degrees",
         .range = between(-90, 90),
         .with = {"type", {"sun", "day_sky"}},
         .absent = "from direction; day_sky: from the scene's sun",
         .meaning = "of the sun above the horizon"});
  t.key("angular_radius", &L::angular_radius,
        {.unit = "degrees",
         .range = {0, 90, true, true},
         .with = {"type", {"sun"}},
         .meaning = "half the sun's width in the sky: larger makes softer shadows"});
  t.key("irradiance", &L::irradiance,
        {.unit = "W/m^2",
         .range = at_least(0),
         .with = {"type", {"sun"}},
         .meaning = "on a plane that faces the sun"});
  t.key("radiance", &L::radiance,
        {.unit = kRadiance,
         .range = at_least(0),
         .with = {"type", {"quad", "sphere", "constant", "image"}},
         .required = true,
         .meaning = "how bright it looks; image: where a pixel is 1"});
  const Condition sky{"type", {"sky"}};
  t.key("zenith", &L::zenith, {.unit = kRadiance, .range = at_least(0), .with = sky, .meaning = "overhead"});
  t.key("horizon", &L::horizon,
        {.unit = kRadiance, .range = at_least(0), .with = sky, .meaning = "at the horizon"});
  t.key("ground", &L::ground,
        {.unit = kRadiance,
         .range = at_least(0),
         .with = {"type", {"sky", "day_sky"}},
         .meaning = "below the horizon"});
  t.key("turbidity", &L::turbidity,
        {.range = between(1.7, 10),
         .with = {"type", {"day_sky"}},
         .meaning = "haze: 2 is very clear, 3 clear, 6 hazy"});
  t.key("scale", &L::scale,
        {.unit = kRadiance,
         .range = at_least(0),
         .with = {"type", {"day_sky"}},
         .meaning = "of a luminance of 1 kcd/m^2"});
  t.key("file", &L::file,
        {.with = {"type", {"image"}},
         .required = true,
         .meaning =
             "image (PFM, PNG, PPM) of all directions: up in the top row, -Z in the middle column, +X right "
             "of it"});
  t.key("rotation", &L::rotation,
        {.unit = "degrees", .with = {"type", {"image"}}, .meaning = "of the image about +Y"});
  return t.take();
}

TableSpec surface_table() {
  using S = SurfaceConfig;
  auto t = repeated_table<&SceneConfig::surfaces>("surface",
                                                  "a look that the ground, colliders and objects may have");
  const std::vector<std::string> kinds = {"diffuse", "mirror", "glossy", "dielectric",
                                          "emission"};  // in the order of enum SurfaceKind
  const Condition patterned{"type", {"diffuse", "mirror", "glossy"}};
  t.key("name", &S::name, {.required = true, .meaning = "what others call it by"});
  t.key("type", &S::kind,
        {.choices = kinds, .meaning = "matt, mirroring, shiny, clear as glass, or glowing"});
  t.key("albedo", &S::albedo,
        {.range = between(0, 1),
         .with = patterned,
         .meaning = "reflected part, linear RGB; glossy: of light from straight above"});
  t.key(
      "roughness", &S::roughness,
      {.range = between(0.03, 1),
       .with = {"type", {"glossy"}},
       .meaning = "of its facets: 0.03 mirrors, 0.3 is satin; above 0.5 it darkens, as light that meets more "
                  "than one facet is lost"});
  t.key("ior", &S::ior,
        {.range = between(0.2, 5),
         .with = {"type", {"dielectric"}},
         .meaning = "refractive index inside over that outside: glass 1.5, ice 1.31, water 1.33"});
  t.key("checker", &S::checker,
        {.range = between(-1, 1),
         .with = patterned,
         .absent = "no pattern",
         .meaning = "second albedo of a checker pattern; -1: none"});
  t.key("checker_size", &S::checker_size,
        {.unit = "m", .range = above(0), .with = patterned, .meaning = "side of a square of the pattern"});
  t.key(
      "texture", &S::file,
      {.with = patterned,
       .absent = "no texture",
       .meaning = "image file (PNG, PPM, PFM) that takes the albedo's place, repeated along the two axes of "
                  "the shape that the surface faces least"});
  t.key("texture_size", &S::texture_size,
        {.unit = "m", .range = above(0), .with = patterned, .meaning = "width of the texture"});
  t.key("emission", &S::emission,
        {.unit = kRadiance,
         .range = at_least(0),
         .with = {"type", {"emission"}},
         .required = true,
         .meaning = "how bright it glows"});
  return t.take();
}

TableSpec output_table() {
  using O = OutputConfig;
  auto t = single_table<O>("output", "what is written",
                           [](SceneConfig& s, std::size_t) -> O& { return s.output; });
  t.key(
      "formats", &O::formats,
      {.choices = {"png", "ppm", "pfm", "exr"},
       .meaning = "of the pictures; pfm and exr are linear, without exposure; exr where firn was built with "
                  "OpenEXR"});
  t.key("layers", &O::layers,
        {.choices = {std::begin(kLayerNames), std::end(kLayerNames)},
         .meaning = "of pfm (a file each) and exr (one file): beauty, which is always there; the first "
                    "surface's albedo, normal and depth (m); the light of sparkle and of paths below a "
                    "surface; samples and the variance of the mean luminance of each pixel"});
  t.key("denoise", &O::denoise,
        {.meaning = "take noise out of the pictures, sparkle left as it is; the layers stay as they are"});
  t.key("tone_map", &O::tone_map,
        {.choices = {"soft", "srgb", "filmic"},  // in the order of enum ToneMap
         .meaning = "of png and ppm. soft: as it is up to 0.5, brighter light rolls off; srgb: clipped at 1; "
                    "filmic: darker shadows, more contrast, a long roll-off"});
  t.key("exposure", &O::exposure,
        {.unit = "stops", .range = between(-30, 30), .meaning = "+1 is twice as bright"});
  t.key("movie", &O::movie, {.meaning = "make a movie of the pictures"});
  t.key("particles", &O::particles, {.meaning = "keep every frame's particles, for `firn render RUN`"});
  t.key("checkpoint_every", &O::checkpoint_every,
        {.unit = "frames",
         .range = between(0, 1000000),
         .meaning = "save the state to go on from; 0: only when interrupted"});
  return t.take();
}

}  // namespace

std::vector<TableSpec> picture_tables() {
  return {camera_table(), image_table(),   object_table(), medium_table(),
          light_table(),  surface_table(), output_table()};
}

}  // namespace firn
