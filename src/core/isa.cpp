// SPDX-License-Identifier: MIT
#include "src/core/isa.h"

#include "src/core/error.h"

namespace firn {

std::vector<const kernels::KernelTable*> supported_kernels() {
  std::vector<const kernels::KernelTable*> tables{&kernels::isa_base::table()};
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2") &&
      __builtin_cpu_supports("bmi")) {
    tables.push_back(&kernels::isa_v3::table());
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
      tables.push_back(&kernels::isa_v4::table());
    }
  }
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
  throw Error(ExitCode::usage, "--isa",
              "'" + name + "' is not an instruction set of this CPU; it has: " + names);
}

}  // namespace firn
