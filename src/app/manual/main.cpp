// SPDX-License-Identifier: MIT
// Writes the man pages and the completions while firn is built.
//
// usage: firn-manual FOLDER SCENES PAGES    (where they go; where scenes and documents will be installed)
#include <exception>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>

#include "firn/error.h"
#include "src/app/manual/manual.h"

namespace firn {
namespace {

void write_manual(const std::string& folder, const InstalledFolders& installed) {
  const CommandLine words = command_line();
  const std::pair<const char*, std::string> files[] = {
      {"firn.1", program_page(words, installed)}, {"firn-scene.5", scene_page()},
      {"firn", bash_completion(words)},           {"_firn", zsh_completion(words)},
      {"firn.fish", fish_completion(words)},
  };
  for (const auto& [name, text] : files) {
    std::ofstream file(folder + "/" + name, std::ios::binary);
    if (!(file << text).flush()) throw Error(ErrorCode::io, "", "cannot write " + folder + "/" + name);
  }
}

}  // namespace
}  // namespace firn

int main(int count, char** words) {
  try {
    if (count != 4) throw firn::Error(firn::ErrorCode::usage, "", "usage: firn-manual FOLDER SCENES PAGES");
    firn::write_manual(words[1], {words[2], words[3]});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "firn-manual: " << error.what() << "\n";
    return 1;
  }
}
