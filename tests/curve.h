// SPDX-License-Identifier: MIT
// What a test measures, as a table for the figures of docs/validation.md and docs/rendering.md: one file a
// curve in the folder that FIRN_FIGURES names. `./dev figures` sets it and runs the tests tagged [figure],
// which then measure more than a test needs. Where only FIRN_CURVES is set, as for `./dev test`, curves of
// the tests' own sizes go there: tests/figures draws them too.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>

namespace firn::test {

// Whether figures are made: then tests may add larger sizes than a test should take.
inline bool makes_figures() { return std::getenv("FIRN_FIGURES") != nullptr; }

class Curve {
 public:
  // columns: the header line, units in the names; the first column is the series that a row belongs to.
  Curve(const std::string& name, const std::string& columns) {
    const char* folder = std::getenv(makes_figures() ? "FIRN_FIGURES" : "FIRN_CURVES");
    if (folder == nullptr) return;
    std::filesystem::create_directories(folder);
    out_.open(std::string(folder) + "/" + name + ".csv");
    out_.precision(9);
    out_ << columns << '\n';
  }

  void add(const std::string& series, std::initializer_list<double> values) {
    if (!out_.is_open()) return;
    out_ << '"' << series << '"';  // it may have commas
    for (const double value : values) out_ << ',' << value;
    out_ << '\n';
  }

 private:
  std::ofstream out_;
};

}  // namespace firn::test
