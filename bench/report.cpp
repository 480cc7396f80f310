// SPDX-License-Identifier: MIT
#include "bench/report.h"

#include <fstream>

#include "bench/machine.h"
#include "firn/error.h"

namespace firn::bench {

namespace {

#if defined(__clang__)
constexpr const char* kCompiler = "clang " __clang_version__;
#else
constexpr const char* kCompiler = "gcc " __VERSION__;
#endif

}  // namespace

void add_provenance(Json& report) {
  const Machine machine = this_machine();
  report["machine"] = {{"cpu", machine.cpu}, {"slug", machine.slug}, {"cores", machine.cores}};
  report["compiler"] = kCompiler;
}

void write_json(const Json& report, const std::string& path) {
  std::ofstream out(path);
  out << report.dump(2) << '\n';
  if (!out.flush()) throw Error(ErrorCode::io, path, "cannot be written");
}

}  // namespace firn::bench
