// SPDX-License-Identifier: MIT
// Names of scenes and of what is in them: words of any script, fit for paths of --set and for folders.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace firn {

// Letters and digits of any script, _ and -: every ASCII character is looked at, all others pass.
bool is_name(std::string_view text);

// "my scene.resolved.toml" -> "my_scene".
std::string name_from_file(const std::string& file);

// What stands in the place of a file where a program gives arrays: "arrays:0", by their number in its scene.
std::string name_of_arrays(std::size_t number);
bool names_arrays(std::string_view file);
std::optional<std::size_t> number_of_arrays(std::string_view file);  // empty: it names none

bool is_utf8(std::string_view bytes);

}  // namespace firn
