// SPDX-License-Identifier: MIT
// firn::Simulation: a scene, the solver made of it, and threads of its own.
#include "firn/simulation.h"

#include <algorithm>
#include <cmath>
#include <istream>
#include <iterator>
#include <ostream>
#include <sstream>
#include <utility>
#include <vector>

#include "firn/error.h"
#include "src/core/isa.h"
#include "src/core/threads.h"
#include "src/io/byte_stream.h"
#include "src/io/file.h"
#include "src/io/npy.h"
#include "src/io/point_file.h"
#include "src/scene/add_snow.h"
#include "src/scene/name.h"
#include "src/scene/scene.h"
#include "src/session/prepare.h"

namespace firn {
namespace {

constexpr std::string_view kMagic = "FIRNSIMU";
constexpr std::uint32_t kVersion = 2;
constexpr std::uint64_t kMostArrays = 1 << 20;

Solver make_solver(Threads& threads, const SimulationOptions& options, const SceneConfig& scene) {
  return threads.run(
      [&] { return Solver(choose_kernels(options.isa), build_simulation(scene, options.force)); });
}

// With the grid spacing that the simulation has, whatever snow is added.
SceneConfig with_spacing(SceneConfig scene, double dx) {
  scene.simulation.dx = dx;
  scene.simulation.particles_across = std::nullopt;
  return scene;
}

std::string saved_arrays(const SceneConfig& scene) {
  std::string saved;
  for (const SnowConfig& snow : scene.snow) {
    if (!snow.shape.points) continue;
    const std::string points = encode_npz(*snow.shape.points);
    put(saved, static_cast<std::uint64_t>(*number_of_arrays(*snow.shape.file)));
    put(saved, static_cast<std::uint64_t>(points.size()));
    saved += points;
  }
  return saved;
}

std::vector<std::shared_ptr<const PointCloud>> loaded_arrays(ByteReader in) {
  std::vector<std::shared_ptr<const PointCloud>> arrays;
  while (in.left() > 0) {
    const auto number = in.get<std::uint64_t>(), bytes = in.get<std::uint64_t>();
    if (number >= kMostArrays) in.fail("damaged: more arrays than a scene has");
    if (number >= arrays.size()) arrays.resize(number + 1);
    arrays[number] = std::make_shared<const PointCloud>(decode_points(in.take(bytes), "load"));
  }
  return arrays;
}

}  // namespace

struct Simulation::State {
  State(Scene made_of, const SceneConfig& config, const SimulationOptions& options)
      : scene(std::move(made_of)),
        dx(grid_spacing(config)),
        placed(config.snow.size()),
        base(std::string_view(choose_kernels(options.isa).isa) == "base"),
        threads(require_threads(options.threads)),
        solver(make_solver(threads, options, config)) {}

  Scene scene;         // with the snow that was added
  double dx;           // m
  std::size_t placed;  // snow objects at the start
  bool base;           // whether its kernels are those of `base`, whose bits are others
  Threads threads;
  Solver solver;
};

Simulation::Simulation(const Scene& scene, const SimulationOptions& options)
    : state_(std::make_unique<State>(scene, config_of(scene), options)) {}
Simulation::Simulation(std::unique_ptr<State> state) : state_(std::move(state)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

bool Simulation::advance_to(double time, const std::stop_token& stop) {
  if (!std::isfinite(time)) throw Error(ErrorCode::usage, "time", "a simulation goes on to a finite time");
  return state_->threads.run([&] { return state_->solver.advance_to(time, stop); });
}

double Simulation::step() {
  return state_->threads.run([&] { return state_->solver.stable_advance(); });
}

const Scene& Simulation::scene() const { return state_->scene; }
double Simulation::time() const { return state_->solver.time(); }
double Simulation::reached() const { return state_->solver.reached(); }
std::size_t Simulation::size() const { return state_->solver.particle_count(); }

Metrics Simulation::metrics() const {
  return state_->threads.run([&] { return state_->solver.metrics(); });
}

void Simulation::snapshot(Snapshot& out, const StateColumns& columns) const {
  state_->threads.run([&] { state_->solver.snapshot(out, columns); });
  out.frame = 0;
}

Snapshot Simulation::snapshot(const StateColumns& columns) const {
  Snapshot out;
  snapshot(out, columns);
  return out;
}

std::uint64_t Simulation::hash() const {
  return state_->threads.run([&] { return state_->solver.state_hash(); });
}

int Simulation::add_snow(const Table& keys, const char* file, int line) {
  return add_snow(keys, Place{std::string(file) + ":" + std::to_string(line)});
}

int Simulation::add_snow(const Table& keys, const Place& place) {
  Scene scene = state_->scene;
  scene.add("snow", keys, place);
  return place_last(std::move(scene));
}

int Simulation::add_points(const Points& points, const Table& keys, const char* file, int line) {
  return add_points(points, keys, Place{std::string(file) + ":" + std::to_string(line)});
}

int Simulation::add_points(const Points& points, const Table& keys, const Place& place) {
  Scene scene = state_->scene;
  scene.add_points(points, keys, place);
  return place_last(std::move(scene));
}

// The last snow of the scene, which is this simulation's and one more.
int Simulation::place_last(Scene scene) {
  const SceneConfig config = with_spacing(config_of(scene), state_->dx);
  const std::size_t index = config.snow.size() - 1;
  state_->threads.run([&] {
    const Snapshot there = snapshot();
    const std::vector<Collider> colliders = state_->solver.colliders_now();
    const std::optional<Shape> domain = domain_of(config);
    state_->solver.add(place_among(config, index, {there, colliders, domain, state_->dx}));
  });
  state_->scene = std::move(scene);
  return static_cast<int>(index);
}

std::size_t Simulation::remove_snow(std::span<const std::uint32_t> ids) {
  return state_->threads.run([&] { return state_->solver.remove({ids.begin(), ids.end()}); });
}

void Simulation::drive(const std::string& collider, ColliderDriver driver) {
  const std::size_t index = collider_number(config_of(state_->scene), collider, driver);
  state_->threads.run([&] { state_->solver.drive(index, std::move(driver)); });
}

// "FIRNSIMU", u32 version, u32 1 if its kernels are those of `base`, u64 snow objects at the start, u64 bytes
// of the scene as TOML, u64 bytes of the state, both, for each array that the scene has in the place of a
// file u64 its number, u64 bytes, those of a .npz; u64 XXH3 of all before.
void Simulation::save(std::ostream& out) const {
  std::ostringstream solver;
  state_->solver.save(solver);
  const std::string state = std::move(solver).str();
  const SceneConfig config = with_spacing(config_of(state_->scene), state_->dx);
  const std::string scene = resolved_toml(config), arrays = saved_arrays(config);
  std::string head(kMagic);
  put(head, kVersion);
  put(head, static_cast<std::uint32_t>(state_->base));
  put(head, static_cast<std::uint64_t>(state_->placed));
  put(head, static_cast<std::uint64_t>(scene.size()));
  put(head, static_cast<std::uint64_t>(state.size()));
  head += scene;
  const std::string_view pieces[] = {head, state, arrays};
  std::string hash;
  put(hash, hash_pieces(pieces));
  for (const std::string_view piece :
       {std::string_view(head), std::string_view(state), std::string_view(arrays), std::string_view(hash)})
    out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
  if (!out.flush()) throw Error(ErrorCode::io, "save", "the stream takes no more");
}

Simulation Simulation::load(std::istream& in, const SimulationOptions& options) {
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  ByteReader reader(bytes, "load");
  if (bytes.size() < kMagic.size() || reader.take(kMagic.size()) != kMagic)
    reader.fail("this is not a saved simulation of firn");
  if (const auto version = reader.get<std::uint32_t>(); version != kVersion) {
    reader.fail("a saved simulation of version " + std::to_string(version) + ", this firn reads version " +
                std::to_string(kVersion));
  }
  const bool base = reader.get<std::uint32_t>() != 0;
  const auto placed = reader.get<std::uint64_t>(), scene_bytes = reader.get<std::uint64_t>(),
             state_bytes = reader.get<std::uint64_t>();
  const std::string_view toml = reader.take(scene_bytes), state = reader.take(state_bytes);
  const std::size_t body = bytes.size() - std::min(bytes.size(), sizeof(std::uint64_t));
  if (reader.left() < sizeof(std::uint64_t) ||
      hash_bytes(bytes.data(), body) !=
          ByteReader(std::string_view(bytes).substr(body), "load").get<std::uint64_t>())
    reader.fail("damaged: wrong checksum");
  Scene scene =
      scene_with(Scene::parse(std::string(toml), "saved scene"),
                 loaded_arrays({std::string_view(bytes).substr(bytes.size() - reader.left(),
                                                               reader.left() - sizeof(std::uint64_t)),
                                "load"}));
  SceneConfig config = config_of(scene);
  if (placed > config.snow.size()) reader.fail("damaged: more snow than its scene has");
  const std::vector<SnowConfig> added(config.snow.begin() + static_cast<std::ptrdiff_t>(placed),
                                      config.snow.end());
  config.snow.resize(placed);
  SimulationOptions same = options;
  if (base && same.isa == "auto") same.isa = "base";
  auto loaded = std::make_unique<State>(std::move(scene), config, same);
  if (loaded->base != base) {
    throw Error(ErrorCode::usage, "isa",
                std::string("this state is one of the kernels of ") + (base ? "base" : "AVX") +
                    ", and those of base and of AVX differ in the last bits");
  }
  loaded->threads.run([&] {
    for (const SnowConfig& snow : added)
      loaded->solver.add({snow.name, snow.material, {}, {}, {}, 0, snow.terminal_velocity, {}, {}});
    std::istringstream stream{std::string(state)};
    loaded->solver.load(stream);
  });
  return Simulation(std::move(loaded));
}

}  // namespace firn
