// SPDX-License-Identifier: MIT
// NumPy arrays in C's order. Their strides are said: before version 2.12 pybind11 reckons them wrongly for
// NumPy 2.
#pragma once
#include <pybind11/numpy.h>

#include <vector>

namespace firn::python {

namespace py = pybind11;

using Shape = std::vector<py::ssize_t>;

template <class T>
Shape strides_of(const Shape& shape) {
  Shape strides(shape.size());
  py::ssize_t bytes = sizeof(T);
  for (std::size_t axis = shape.size(); axis-- > 0;) {
    strides[axis] = bytes;
    bytes *= shape[axis];
  }
  return strides;
}

// Of its own memory, which is not set.
template <class T>
py::array_t<T> new_array(const Shape& shape) {
  return py::array_t<T>(shape, strides_of<T>(shape));
}
// A view of memory that `owner` keeps alive; without one, a copy.
template <class T>
py::array_t<T> array_at(const Shape& shape, const T* data, const py::object& owner = {}) {
  return py::array_t<T>(shape, strides_of<T>(shape), data, owner);
}

}  // namespace firn::python
