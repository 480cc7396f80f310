// SPDX-License-Identifier: MIT
// firn::Simulation for firn/_simulation.py. Whatever computes does so without the lock of the interpreter.
#include "python/src/simulation.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>

#include "firn/simulation.h"
#include "python/src/driver.h"
#include "python/src/metrics.h"
#include "python/src/points.h"
#include "python/src/use.h"
#include "python/src/values.h"
#include "python/src/work.h"

namespace firn::python {
namespace {

class Bytes : public std::streambuf {
 public:
  explicit Bytes(std::string_view bytes) {
    char* const begin = const_cast<char*>(bytes.data());  // which nobody writes to
    setg(begin, begin, begin + bytes.size());
  }
};

// A simulation with its guard. It holds no reference to its drivers' owner, so that there are no cycles
// through C++: firn/_simulation.py gives functions with a weak one.
class CoreSimulation {
 public:
  CoreSimulation(const Scene& scene, int threads, const std::string& isa, bool force) {
    const auto made = std::make_shared<std::optional<Simulation>>();
    run_alone(
        [made, scene, options = SimulationOptions{threads, isa, force}] { made->emplace(scene, options); });
    simulation_.emplace(std::move(**made));
  }
  CoreSimulation(const py::bytes& saved, int threads, const std::string& isa, bool force) {
    const std::string_view bytes = saved;
    const py::gil_scoped_release unlocked;
    Bytes buffer(bytes);
    std::istream in(&buffer);
    simulation_.emplace(Simulation::load(in, {threads, isa, force}));
  }
  // Taking down much memory takes time.
  ~CoreSimulation() {
    const py::gil_scoped_release unlocked;
    simulation_.reset();
  }

  // f(simulation), without the lock of the interpreter.
  template <class F>
  auto with(F&& f) {
    const OneUser::Use use(user_, "the simulation");
    const py::gil_scoped_release unlocked;
    return f(*simulation_);
  }

  bool advance_to(double time, const py::object& watch) {
    const OneUser::Use use(user_, "the simulation");
    bool reached = false;
    run_watched([&](const std::stop_token& stop) { reached = simulation_->advance_to(time, stop); }, watch);
    return reached;
  }
  double reached() const { return simulation_->reached(); }

  void drive(const std::string& collider, const py::function& driver) {
    const ColliderDriver call = driver_of(driver, user_);
    with([&](Simulation& s) { s.drive(collider, call); });
  }

 private:
  OneUser user_;
  std::optional<Simulation> simulation_;
};

py::bytes saved(CoreSimulation& core) {
  std::ostringstream out;
  core.with([&](Simulation& s) { s.save(out); });
  return py::bytes(std::move(out).str());
}

int add_snow(CoreSimulation& core, const py::dict& keys, const std::string& place) {
  const Table table = table_of(keys);
  return core.with([&](Simulation& s) { return s.add_snow(table, Place{place}); });
}

int add_points(CoreSimulation& core, const py::dict& columns, const py::dict& keys,
               const std::string& place) {
  const Points points = points_of(columns);
  const Table table = table_of(keys);
  return core.with([&](Simulation& s) { return s.add_points(points, table, Place{place}); });
}

using Ids = py::array_t<std::uint32_t, py::array::c_style>;

std::size_t remove_snow(CoreSimulation& core, const Ids& ids) {
  const std::span<const std::uint32_t> all(ids.data(), static_cast<std::size_t>(ids.size()));
  return core.with([&](Simulation& s) { return s.remove_snow(all); });
}

std::unique_ptr<Snapshot> snapshot(CoreSimulation& core, bool F, bool Jp, bool J, bool stress) {
  auto snow = std::make_unique<Snapshot>();
  core.with([&](Simulation& s) { s.snapshot(*snow, {F, Jp, J, stress}); });
  return snow;
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::class_<CoreSimulation>(module, "Simulation", "firn::Simulation; firn.Simulation is its face.")
      .def(py::init<const Scene&, int, const std::string&, bool>())
      .def(py::init<const py::bytes&, int, const std::string&, bool>())
      .def("advance_to", &CoreSimulation::advance_to)
      .def("reached", &CoreSimulation::reached)
      .def("step", [](CoreSimulation& core) { return core.with([](Simulation& s) { return s.step(); }); })
      .def("time", [](CoreSimulation& core) { return core.with([](Simulation& s) { return s.time(); }); })
      .def("size", [](CoreSimulation& core) { return core.with([](Simulation& s) { return s.size(); }); })
      .def("metrics",
           [](CoreSimulation& core) {
             return fields_of(core.with([](Simulation& s) { return s.metrics(); }));
           })
      .def("snapshot", &snapshot)
      .def("hash", [](CoreSimulation& core) { return core.with([](Simulation& s) { return s.hash(); }); })
      .def("add_snow", &add_snow)
      .def("add_points", &add_points)
      .def("scene",
           [](CoreSimulation& core) { return core.with([](Simulation& s) { return Scene(s.scene()); }); })
      .def("remove_snow", &remove_snow)
      .def("drive", &CoreSimulation::drive)
      .def("save", &saved);
}

}  // namespace firn::python
