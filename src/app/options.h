// SPDX-License-Identifier: MIT
// The command line as values.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firn/session.h"
#include "src/scene/scene.h"

namespace firn {

struct Options {
  std::string command;  // run simulate render resume check params info
  std::string target;   // SCENE, RUN, or the prefix of `params`; empty where it may be left out
  std::vector<SceneOverride> overrides;
  bool quick = false;
  bool quiet = false;
  bool markdown = false;  // params: as the page docs/scene_format.md
  bool json = false;      // info
  SessionOptions session;

  ReadOptions reading() const { return {quick, overrides}; }
};

// Empty when --help or --version was asked for and printed. Errors: usage Error.
std::optional<Options> parse_options(int count, const char* const* arguments);

}  // namespace firn
