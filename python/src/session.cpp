// SPDX-License-Identifier: MIT
// firn::Session for firn/_session.py, which holds the observer; what is handed in here refers to it weakly.
#include "python/src/session.h"

#include <pybind11/stl.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firn/session.h"
#include "python/src/driver.h"
#include "python/src/observer.h"
#include "python/src/use.h"
#include "python/src/work.h"

namespace firn::python {
namespace {

namespace py = pybind11;

using Overrides = std::vector<std::pair<std::string, std::string>>;  // path, value as TOML

template <class T>
void take(const py::dict& given, const char* name, T& option) {
  if (given.contains(name)) option = given[name].cast<T>();
}

SessionOptions options_of(const py::dict& given) {
  SessionOptions options;
  take(given, "out", options.out);
  take(given, "frames", options.frames);
  take(given, "pictures", options.pictures);
  take(given, "particles", options.particles);
  take(given, "movie", options.movie);
  take(given, "threads", options.threads);
  take(given, "isa", options.isa);
  take(given, "overlap", options.overlap);
  take(given, "force", options.force);
  take(given, "overwrite", options.overwrite);
  take(given, "command", options.command);
  return options;
}

py::dict fields_of(const SessionResult& result) {
  py::list intervals;
  for (const StageInterval& i : result.intervals)
    intervals.append(py::make_tuple(i.stage, i.frame, i.begin, i.end, i.thread));
  py::dict all;
  all["interrupted"] = result.interrupted;
  all["nothing_to_do"] = result.nothing_to_do;
  all["kept"] = result.kept;
  all["left"] = result.left;
  all["intervals"] = intervals;
  return all;
}

class CoreSession {
 public:
  using Begin = std::function<Session(Observer&)>;

  CoreSession(const Begin& begin, const py::object& target)
      : observer_(std::make_unique<ForwardingObserver>(target)) {
    run_watched([&](const std::stop_token&) { session_.emplace(begin(*observer_)); }, py::none());
    folder_ = session_->folder();
    shares_ = session_->shares();
  }
  ~CoreSession() { end(); }

  py::dict run(const py::object& watch) {
    const OneUser::Use use(user_, "the session", true);
    require_session();
    const Ending ending{*this};
    SessionResult result;
    run_watched([&](const std::stop_token& stop) { result = session_->run(stop); }, watch);
    return fields_of(result);
  }
  void drive(const std::string& collider, const py::function& driver) {
    const OneUser::Use use(user_, "the session");
    require_session();
    const ColliderDriver call = driver_of(driver, user_);
    const py::gil_scoped_release unlocked;
    session_->drive(collider, call);
  }
  const std::string& folder() const { return folder_; }
  bool shares() const { return shares_; }
  void tell(const std::string& line) {
    const OneUser::Use use(user_, "the session");
    require_session();
    const py::gil_scoped_release unlocked;
    session_->tell(line);
  }

 private:
  // Lets go of the run folder as soon as the work is done, whoever still holds the Python object.
  struct Ending {
    CoreSession& session;
    ~Ending() { session.end(); }
  };
  void end() {
    const py::gil_scoped_release unlocked;
    session_.reset();
  }
  void require_session() const {
    if (!session_)
      throw Error(ErrorCode::usage, folder_,
                  "this session has run already; Session.resume() begins the next one");
  }

  OneUser user_;
  std::string folder_;
  bool shares_ = false;
  std::unique_ptr<ForwardingObserver> observer_;
  std::optional<Session> session_;
};

std::unique_ptr<CoreSession> start(const Scene& scene, const py::dict& given, const py::object& target) {
  const auto begin = [copy = scene, options = options_of(given)](Observer& observer) {
    return Session::start(copy, options, observer);
  };
  return std::make_unique<CoreSession>(begin, target);
}

std::unique_ptr<CoreSession> resume(const std::string& run, const py::dict& given, const py::object& target) {
  const auto begin = [&run, options = options_of(given)](Observer& observer) {
    return Session::resume(run, options, observer);
  };
  return std::make_unique<CoreSession>(begin, target);
}

std::unique_ptr<CoreSession> render(const std::string& run, const py::dict& given, bool quick,
                                    const Overrides& overrides, const py::object& target) {
  ReadOptions changes{quick, {}};
  for (const auto& [path, value] : overrides) changes.overrides.push_back({path, value});
  const auto begin = [&run, &changes, options = options_of(given)](Observer& observer) {
    return Session::render(run, options, changes, observer);
  };
  return std::make_unique<CoreSession>(begin, target);
}

}  // namespace

void bind_session(py::module_& module) {
  py::class_<CoreSession>(module, "Session", "firn::Session; firn.Session is its face.")
      .def_static("start", &start)
      .def_static("resume", &resume)
      .def_static("render", &render)
      .def("drive", &CoreSession::drive)
      .def("run", &CoreSession::run)
      .def("folder", &CoreSession::folder)
      .def("shares", &CoreSession::shares)
      .def("tell", &CoreSession::tell);
}

}  // namespace firn::python
