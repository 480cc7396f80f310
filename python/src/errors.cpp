// SPDX-License-Identifier: MIT
#include "python/src/errors.h"

#include <exception>

#include "firn/error.h"

namespace firn::python {
namespace {

namespace py = pybind11;

const char* name_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return "usage";
    case ErrorCode::unstable:
      return "unstable";
    case ErrorCode::io:
      return "io";
    case ErrorCode::interrupted:
      return "interrupted";
    case ErrorCode::failed:
      break;
  }
  return "failed";
}

// The classes are written in Python, where a class may have two bases.
void raise(const Error& error) {
  try {
    const py::object made = py::module_::import("firn._errors")
                                .attr("error_of")(name_of(error.code()), error.where(), error.what());
    PyErr_SetObject(py::type::handle_of(made).ptr(), made.ptr());
  } catch (py::error_already_set& other) {
    other.restore();
  }
}

}  // namespace

void bind_errors(py::module_&) {
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      raise(error);
    }
  });
}

}  // namespace firn::python
