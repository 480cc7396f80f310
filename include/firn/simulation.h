// SPDX-License-Identifier: MIT
// The snow of a scene, stepped by a program: without a run folder, pictures or threads beside it. What a
// session keeps of a run, and its pictures, are in firn/session.h.
#pragma once
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "firn/driver.h"
#include "firn/export.h"
#include "firn/metrics.h"
#include "firn/points.h"
#include "firn/scene.h"
#include "firn/snapshot.h"
#include "firn/vector.h"

namespace firn {

// How a simulation is run.
struct SimulationOptions {
  int threads = 0;           // 0: as many as the machine has
  std::string isa = "auto";  // base, x86-64-v3, x86-64-v4, or the best that the CPU has
  bool force = false;        // a fixed dt above the stable bound
};

// Holds the whole state. Not to be used by two threads at a time; several simulations may be, each with its
// own threads. The bits depend on the scene and on what is asked for, not on threads or overlapping work.
class FIRN_API Simulation {
 public:
  // Places the snow. Errors: usage Error for a scene or options that no simulation can be made of, io Error.
  explicit Simulation(const Scene& scene, const SimulationOptions& options = {});
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();

  // Steps until `time` (s) is reached exactly; does nothing if it has passed. False if a stop was requested
  // first: the state is then between two steps, and as good as any. Errors: unstable Error that names step,
  // particle and likely cause; usage Error for a time that is not finite, and after load() while a collider
  // that was driven has no driver; whatever a driver throws; inside of a
  // driver a usage Error.
  bool advance_to(double time, const std::stop_token& stop = {});
  // One step of the longest stable length, or of the scene's fixed one. Returns it, s. Errors: as above.
  double step();

  const Scene& scene() const;  // with the snow that was added
  double time() const;         // s
  // As time(), for other threads too, such as those that draw how far advance_to() has come.
  double reached() const;
  std::size_t size() const;  // particles
  // Sums over the snow as it is now.
  Metrics metrics() const;
  // A copy of the state now. Its `frame` is 0.
  Snapshot snapshot(const StateColumns& columns = {}) const;
  void snapshot(Snapshot& out, const StateColumns& columns = {}) const;  // into memory that is there
  std::uint64_t hash() const;  // of every bit of every particle, in whatever order they are kept

  // More snow, as one more [[snow]] of the scene would have it at its start, now. Returns its number, which
  // is Snapshot::object of its particles; their ids go on from the last. Errors: usage Error for keys that
  // the scene would refuse, for snow that lies in a collider, outside the domain or closer than half its
  // spacing to other snow (unless 'trim' or 'allow_overlap' say otherwise); then nothing has changed.
  int add_snow(const Table& keys, const Place& place);
  int add_snow(const Table& keys, const char* file = __builtin_FILE(), int line = __builtin_LINE());
  // The same of arrays, as Scene::add_points().
  int add_points(const Points& points, const Table& keys, const Place& place);
  int add_points(const Points& points, const Table& keys = {}, const char* file = __builtin_FILE(),
                 int line = __builtin_LINE());
  // Takes the particles with these ids (in any order) out of the simulation. Returns how many there were.
  // Errors: unstable Error for a state that has blown up.
  std::size_t remove_snow(std::span<const std::uint32_t> ids);

  // The named collider moves as `driver` says, from now on and from where it is. The driver is called once
  // before each step, before its length is chosen, by the thread that called advance_to() or step(). Errors:
  // usage Error for a name that no collider has, or one that has a 'motion' of the scene.
  void drive(const std::string& collider, ColliderDriver driver);

  // The whole state with its scene, bit for bit: what load() makes goes on as this would have. Drivers cannot
  // be saved: drive() gives them again. Files that the scene names are read again by load(), which takes all
  // that the stream still holds. Errors: io Error if the stream fails or holds something else; usage Error
  // for kernels of other bits (`base` and the others); those of the constructor.
  void save(std::ostream& out) const;
  static Simulation load(std::istream& in, const SimulationOptions& options = {});

 private:
  struct State;
  explicit Simulation(std::unique_ptr<State> state);
  int place_last(Scene scene);
  std::unique_ptr<State> state_;
};

}  // namespace firn
