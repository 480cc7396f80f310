// SPDX-License-Identifier: MIT
// Names of scenes and of what is in them: words of any script, fit for paths of --set and for folders.
#pragma once
#include <string>
#include <string_view>

namespace firn {

// Letters and digits of any script, _ and -: every ASCII character is looked at, all others pass.
bool is_name(std::string_view text);

// "my scene.resolved.toml" -> "my_scene".
std::string name_from_file(const std::string& file);

bool is_utf8(std::string_view bytes);

}  // namespace firn
