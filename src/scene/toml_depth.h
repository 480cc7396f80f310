// SPDX-License-Identifier: MIT
// How deep TOML text nests, found before it is parsed: toml++ follows the parts of dotted keys by recursion,
// and a key of thousands of parts would overflow the stack.
#pragma once
#include <optional>
#include <string_view>

namespace firn {

struct TextPlace {
  int line, column;  // from 1; columns count UTF-8 characters
};

// Where the text first goes deeper than `most` levels, if it does: each point in the name of a table or a
// key, and each bracket, leads to the next level; so does, once, the point of a number.
std::optional<TextPlace> find_deep_nesting(std::string_view text, int most);

}  // namespace firn
