// SPDX-License-Identifier: MIT
#include "python/src/observer.h"

#include <utility>

namespace firn::python {
namespace {

namespace py = pybind11;

const char* name_of(Stage stage) {
  switch (stage) {
    case Stage::simulate:
      return "simulate";
    case Stage::trace:
      return "trace";
    case Stage::write:
      break;
  }
  return "write";
}

}  // namespace

template <class... Arguments>
void ForwardingObserver::call(const char* method, const Arguments&... arguments) {
  const py::gil_scoped_acquire locked;
  target_.attr(method)(arguments...);
}

ForwardingObserver::ForwardingObserver(py::object target) : target_(std::move(target)) {}

ForwardingObserver::~ForwardingObserver() {
  const py::gil_scoped_acquire locked;
  target_ = {};
}

void ForwardingObserver::message(const std::string& line) { call("message", line); }

void ForwardingObserver::made_folders(const std::vector<std::filesystem::path>& folders) {
  const py::gil_scoped_acquire locked;
  py::list names;
  for (const auto& folder : folders) names.append(folder.string());
  call("made_folders", names);
}

void ForwardingObserver::frames_begin(int count, double seconds) { call("frames_begin", count, seconds); }
void ForwardingObserver::frames_end() { call("frames_end"); }
void ForwardingObserver::stage_begins(Stage stage, int frame) { call("stage_begins", name_of(stage), frame); }
void ForwardingObserver::stage_ends(Stage stage, int frame) { call("stage_ends", name_of(stage), frame); }

}  // namespace firn::python
