// SPDX-License-Identifier: MIT
// Long work for Python: in a thread of its own and without the lock of the interpreter, while the thread that
// asked for it looks for signals, since Python hands these to its main thread alone.
#pragma once
#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <stop_token>

namespace firn::python {

namespace py = pybind11;

// work(stop), with a stop that is requested by Ctrl-C and by `watch`: None, or what is called ten times a
// second in the calling thread and returns whether to stop. Whatever a signal handler or `watch` raises comes
// out once the work has ended; otherwise what the work throws.
void run_watched(const std::function<void(const std::stop_token&)>& work, const py::object& watch);

// work() that knows no stop and shares nothing with anybody: Ctrl-C raises KeyboardInterrupt at once, and the
// thread ends by itself. The process waits for it at its end.
void run_alone(std::function<void()> work);

void bind_work(py::module_& module);

}  // namespace firn::python
