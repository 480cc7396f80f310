// SPDX-License-Identifier: MIT
// What a scene will cost and show, without running it: it is read, its snow is placed, a first frame is made
// in part, and the numbers are printed on stdout, warnings on stderr.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "src/app/commands.h"
#include "src/app/report.h"
#include "src/core/isa.h"
#include "src/core/text.h"
#include "src/geometry/point_cloud.h"
#include "src/mpm/solver.h"
#include "src/render/frame_tracer.h"
#include "src/scene/footing.h"
#include "src/scene/place_points.h"
#include "src/scene/scene.h"
#include "src/scene/validate.h"
#include "src/session/prepare.h"
#include "src/session/rehearsal.h"

namespace firn {
namespace {

constexpr double kStrained = 1.05;  // times as fast as unstrained, a wave in snow about to yield
constexpr double kBuried = 0.02;    // less of a body may dip into what it lies on
constexpr double kFewInCell = 2;    // points
constexpr double kOddVolume = 2;    // times what a point has room for

constexpr int kMostOfAKind = 10;  // warnings that are printed one by one

// What looks like a mistake in a scene, on stderr. Of each kind the first few are printed, the rest counted.
class Warnings {
 public:
  explicit Warnings(const SceneConfig& scene) : scene_(scene) {}

  // `kind` is what several bodies of snow do.
  void add(const char* kind, std::size_t body, const std::string& what) {
    if (++counts_[kind] <= kMostOfAKind) print(place_of(scene_, table_of("snow", body)), what);
  }

  void print_counts() const {
    for (const auto& [kind, count] : counts_) {
      if (count > kMostOfAKind)
        print(scene_.file,
              "of " + grouped(scene_.snow.size()) + " bodies of snow " + grouped(count) + " " + kind);
    }
  }

 private:
  static void print(const std::string& place, const std::string& what) {
    std::fprintf(stderr, "%s: warning: %s\n", place.c_str(), escape_control(what).c_str());
  }

  const SceneConfig& scene_;
  std::map<std::string, std::uint64_t> counts_;
};

std::string box(const Bounds& b) {
  return text("x %.4g to %.4g, y %.4g to %.4g, z %.4g to %.4g m", b.min.x(), b.max.x(), b.min.y(), b.max.y(),
              b.min.z(), b.max.z());
}

void print_snow(const SolverSetup& setup) {
  std::size_t particles = 0;
  double mass = 0;
  for (const auto& snow : setup.snow) {
    particles += snow.position.size();
    mass += static_cast<double>(snow.position.size()) * snow.particle_mass();
  }
  print_line("particles", grouped(particles) + text(", %.4g kg", mass));
  for (const auto& snow : setup.snow) {
    const auto count = static_cast<double>(snow.position.size());
    print_line("  " + snow.name,
               grouped(snow.position.size()) +
                   text(", %.4g kg, %.4g m3, %.4g mg a particle", count * snow.particle_mass(),
                        count * snow.particle_volume, 1e6 * snow.particle_mass()));
    Bounds bounds;
    for (const Vec3& p : snow.position) bounds.include(p);
    print_line("", box(bounds));
  }
}

// What stands in the way of snow at the start, of all that is seen or felt.
struct Solids {
  std::vector<std::string> names;
  std::vector<Shape> shapes;
};

Solids solids_of(const SolverSetup& setup, const RenderSetup& render) {
  Solids solids;
  for (const Collider& c : setup.colliders) {
    solids.names.push_back(c.name == "ground" ? "the ground" : "collider '" + c.name + "'");
    solids.shapes.push_back({c.shape.form, c.motion.pose(c.shape.pose, 0)});
  }
  for (const Object& o : render.objects) {
    const SurfaceKind kind = render.surfaces[static_cast<std::size_t>(o.surface)].kind;
    if (kind == SurfaceKind::dielectric || kind == SurfaceKind::none) continue;  // snow may lie in glass
    if (std::find(solids.names.begin(), solids.names.end(), o.name) != solids.names.end()) continue;
    solids.names.push_back(o.name);
    solids.shapes.push_back({o.shape.form, o.motion.pose(o.shape.pose, 0)});
  }
  return solids;
}

bool is_at_rest(const SnowConfig& snow) {
  return snow.velocity.isZero(0) && snow.spin.isZero(0) && !snow.terminal_velocity;
}

void warn_of_footing(Warnings& warnings, const SceneConfig& scene, const SolverSetup& setup,
                     const Solids& solids) {
  const std::vector<Footing> footings = footing_of(setup, solids.shapes);
  for (std::size_t i = 0; i < footings.size(); ++i) {
    const Footing& f = footings[i];
    const std::string name = "snow '" + setup.snow[i].name + "'";
    if (f.buried > kBuried)
      warnings.add(
          "lie in part under a surface", i,
          text("%.3g %% of ", 100 * f.buried) + name + " lies under the surface of " + solids.names[f.solid]);
    if (setup.gravity.isZero(0) || !is_at_rest(scene.snow[i])) continue;
    if (std::isinf(f.clearance)) {
      warnings.add("float", i, name + " floats: there is no ground or collider to fall onto");
    } else if (f.clearance > 2 * setup.dx) {
      warnings.add("float", i,
                   name + " floats: all that it could lie on is " + text("%.3g m", f.clearance) +
                       " away or more, and it will fall");
    }
  }
}

void print_sights(Warnings& warnings, const SolverSetup& setup, const RenderSetup& render,
                  const Sights& sights) {
  std::string seen;
  const auto add = [&](const std::string& name, std::size_t pixels) {
    if (pixels > 0)
      seen += (seen.empty() ? "" : ", ") + name +
              text(" %.2g %%", 100. * static_cast<double>(pixels) / static_cast<double>(sights.pixels));
  };
  for (std::size_t i = 0; i < sights.snow.size(); ++i) add(setup.snow[i].name, sights.snow[i]);
  for (std::size_t i = 0; i < sights.objects.size(); ++i) add(render.objects[i].name, sights.objects[i]);
  add("sky and lamps", sights.nothing);
  print_line("camera sees", seen);
  for (std::size_t i = 0; i < sights.snow.size(); ++i) {
    if (sights.snow[i] == 0)
      warnings.add("are not seen in frame 0", i,
                   "the camera sees nothing of snow '" + setup.snow[i].name + "' in frame 0");
  }
}

// Points of a file lie as they lie: the grid may be too fine for them, or their volumes in another unit.
void warn_of_points(Warnings& warnings, const SceneConfig& scene, const SolverSetup& setup) {
  for (std::size_t i = 0; i < setup.snow.size(); ++i) {
    const PlacedSnow& snow = setup.snow[i];
    if (!is_points(scene.snow[i])) continue;
    const double in_cell = std::pow(setup.dx, 3) / snow.particle_volume;
    if (in_cell < kFewInCell) {
      warnings.add("have few points a cell", i,
                   "snow '" + snow.name +
                       text("' has %.2g points a cell of the grid and will fall apart: ", in_cell) +
                       text("dx = %.3g m is coarse enough for them", 2 * std::cbrt(snow.particle_volume)));
    }
    const double room = volume_of_point(PointTree(snow.position)), ratio = snow.particle_volume / room;
    if (room > 0 && (ratio > kOddVolume || ratio < 1 / kOddVolume)) {
      warnings.add("have points of another size than their distance", i,
                   "a point of snow '" + snow.name +
                       text("' stands for %.3g m3 and has room for %.3g m3: ", snow.particle_volume, room) +
                       "is the file's volume, mass or radius in another unit?");
    }
  }
}

SolverSetup without_particles(const SolverSetup& setup) {
  SolverSetup bare;
  bare.dx = setup.dx;
  bare.gravity = setup.gravity;
  bare.fixed_dt = setup.fixed_dt;
  bare.max_dt = setup.max_dt;
  for (const PlacedSnow& snow : setup.snow) {
    PlacedSnow& one = bare.snow.emplace_back();
    one.name = snow.name;
    one.material = snow.material;
  }
  return bare;
}

// s; of the longest step while the snow is as it was placed, and of that which its packing may come to.
std::pair<double, double> elastic_steps(const SolverSetup& setup) {
  double fresh = setup.max_dt, packed = setup.max_dt;
  for (const PlacedSnow& snow : setup.snow) {
    const double dt = stable_dt(snow.material, setup.dx);
    fresh = std::min(fresh, dt);
    packed = std::min(packed, dt / (kStrained * wave_when_packed(snow.material)));
  }
  return {fresh, packed};
}

void print_time(const SceneConfig& scene, const SolverSetup& setup, const TimeStep& step) {
  const double frame = scene.time.speed / scene.time.fps;
  const auto [fresh, packed] = elastic_steps(setup);
  const double longest = setup.fixed_dt.value_or(std::max(step.dt, fresh)),
               shortest = setup.fixed_dt.value_or(std::min(step.dt, packed));
  print_line("time step", text("%.3g s", setup.fixed_dt.value_or(step.dt)) +
                              (setup.fixed_dt ? std::string(", fixed by the scene")
                                              : " at the start, limited by " + step.cause +
                                                    text("; %.3g s where snow is packed most", shortest)));
  const double least = std::ceil(frame / longest), most = std::ceil(frame / shortest);
  const double frames = scene.time.frames - 1;
  const auto range = [](double low, double high) {
    const std::string from = grouped(static_cast<std::uint64_t>(low));
    return low == high ? from : from + " to " + grouped(static_cast<std::uint64_t>(high));
  };
  print_line("frames", text("%d of %.4g s: ", scene.time.frames, frame) + range(least, most) +
                           " steps a frame, " + range(least * frames, most * frames) + " in all");
}

void print_memory(const Rehearsal& rehearsal, const Solver& simulation) {
  print_line("memory", mebibytes(rehearsal.at_start) + " at frame 0, at most " +
                           mebibytes(rehearsal.peak_low) + " to " + mebibytes(rehearsal.peak_high) +
                           " later");
  const auto particles = static_cast<double>(std::max<std::size_t>(simulation.particle_count(), 1));
  const auto snow = static_cast<double>(simulation.resident_bytes());
  print_line("", "simulation " + mebibytes(snow) + text(" of it (%.0f bytes a particle)", snow / particles));
}

}  // namespace

ExitCode check_command(const Options& options) {
  const auto& kernels = choose_kernels(options.session.isa);
  const SceneConfig scene = read_scene(options.target, options.reading());
  if (scene.output.movie && scene.time.frames > 1)
    require_movie(scene);  // in the order in which a run refuses
  const auto renderer = make_tracer(scene, kernels);
  SolverSetup setup = build_simulation(scene, options.session.force);
  print_line("scene", scene.name + " (" + scene.file + (options.quick ? ", quick size)" : ")"));
  print_snow(setup);
  Warnings warnings(scene);
  warn_of_footing(warnings, scene, setup, solids_of(setup, renderer->setup()));
  warn_of_points(warnings, scene, setup);
  const SolverSetup bare = without_particles(setup);  // a run keeps them no longer, either
  Solver simulation(kernels, std::move(setup));
  print_line("grid", text("dx %.4g m, ", bare.dx) + grouped(simulation.grid_blocks()) +
                         " blocks of 4x4x4 nodes, growing with the snow");
  print_time(scene, bare, simulation.stable_step());
  const Rehearsal rehearsal = rehearse(scene, simulation, *renderer);
  print_memory(rehearsal, simulation);
  print_line("image", text("%dx%d, %d samples, %d bounces", scene.image.width, scene.image.height,
                           scene.image.samples, scene.image.max_bounces));
  print_sights(warnings, bare, renderer->setup(), rehearsal.sights);
  warnings.print_counts();
  return ExitCode::ok;
}

}  // namespace firn
