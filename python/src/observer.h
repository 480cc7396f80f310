// SPDX-License-Identifier: MIT
// A firn::Observer that hands everything on to a Python object of the same methods, from whatever thread.
#pragma once
#include <pybind11/pybind11.h>

#include <filesystem>
#include <string>
#include <vector>

#include "firn/observer.h"

namespace firn::python {

class __attribute__((visibility("hidden"))) ForwardingObserver : public Observer {
 public:
  explicit ForwardingObserver(pybind11::object target);
  ~ForwardingObserver() override;
  void message(const std::string& line) override;
  void made_folders(const std::vector<std::filesystem::path>& folders) override;
  void frames_begin(int count, double seconds) override;
  void frames_end() override;
  void stage_begins(Stage stage, int frame) override;
  void stage_ends(Stage stage, int frame) override;

 private:
  template <class... Arguments>
  void call(const char* method, const Arguments&... arguments);

  pybind11::object target_;
};

}  // namespace firn::python
