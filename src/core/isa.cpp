// SPDX-License-Identifier: MIT
#include "src/core/isa.h"

#include "firn/error.h"

namespace firn {

namespace {

[[maybe_unused]] bool has_v3() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2") &&
         __builtin_cpu_supports("bmi");
}

[[maybe_unused]] bool has_v4() {
  return has_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}

}  // namespace

std::vector<const kernels::KernelTable*> supported_kernels() {
  std::vector<const kernels::KernelTable*> tables{&kernels::isa_base::table()};
#ifdef FIRN_HAS_V3
  if (has_v3()) tables.push_back(&kernels::isa_v3::table());
#endif
#ifdef FIRN_HAS_V4
  if (has_v4()) tables.push_back(&kernels::isa_v4::table());
#endif
  return tables;
}

const kernels::KernelTable& choose_kernels(const std::string& name) {
  const auto tables = supported_kernels();
  if (name == "auto") return *tables.back();
  std::string names = "auto";
  for (const auto* table : tables) {
    if (name == table->isa) return *table;
    names += std::string(", ") + table->isa;
  }
  throw Error(ErrorCode::usage, "isa",
              "'" + name + "' is not an instruction set of this CPU and build; there are: " + names);
}

}  // namespace firn
