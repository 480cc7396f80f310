// SPDX-License-Identifier: MIT
// What is fuzzed: each function here gives one input to one reader of files that people hand to firn. An
// Error of firn is a fair answer to any input. A crash, undefined behaviour, a leak, any other exception, or
// a broken law of the reader (it calls abort through `require`) is a finding. The same functions replay the
// inputs of regressions/.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace firn::fuzz {

void scene(std::string_view input);       // TOML; after a NUL byte one --set a line, "quick" for --quick
void mesh(std::string_view input);        // Wavefront OBJ
void heights(std::string_view input);     // PGM or ESRI ASCII grid
void images(std::string_view input);      // PNG, PPM or PFM
void particles(std::string_view input);   // a particle file
void points(std::string_view input);      // .npz, .npy, .ply or a particle file, as points
void checkpoint(std::string_view input);  // the file around a saved simulation
void state(std::string_view input);       // a saved simulation
void manifest(std::string_view input);    // run.json
void journal(std::string_view input);     // frames.jsonl

// A law that holds for whatever was read.
inline void require(bool holds, const char* law) {
  if (holds) return;
  std::fprintf(stderr, "broken law: %s\n", law);
  std::abort();
}

}  // namespace firn::fuzz
