// SPDX-License-Identifier: MIT
// The command line as values.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/scene/scene.h"

namespace firn {

struct Options {
  std::string command;  // run simulate render resume check params info
  std::string target;   // SCENE, RUN, or the prefix of `params`; empty where it may be left out
  std::string typed;    // the whole command line, for the manifest
  std::vector<SceneOverride> overrides;
  bool quick = false;
  bool force = false;
  bool overwrite = false;
  bool quiet = false;
  bool overlap = true;
  bool markdown = false;  // params: as the page docs/scene_format.md
  bool json = false;      // info
  int threads = 0;        // 0: all
  std::string isa = "auto";
  std::optional<std::string> out;
  std::optional<std::pair<int, int>> frames;  // both included

  ReadOptions reading() const { return {quick, overrides}; }
};

// Empty when --help or --version was asked for and printed. Errors: usage Error.
std::optional<Options> parse_options(int count, const char* const* arguments);

}  // namespace firn
