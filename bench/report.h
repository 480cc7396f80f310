// SPDX-License-Identifier: MIT
// Figures as JSON, always with the machine and the compiler that they belong to.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace firn::bench {

using Json = nlohmann::ordered_json;

// Adds "machine" and "compiler".
void add_provenance(Json& report);

// Errors: io.
void write_json(const Json& report, const std::string& path);

}  // namespace firn::bench
