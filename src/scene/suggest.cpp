// SPDX-License-Identifier: MIT
#include "src/scene/suggest.h"

#include <algorithm>
#include <utility>

#include "src/core/text.h"

namespace firn {
namespace {

constexpr std::size_t kLongestWord = 64;  // nobody means a key of firn by a longer one

// Words of other programs for what has another name here; the first that is known where it stands is meant.
constexpr std::pair<const char*, const char*> kSynonyms[] = {
    {"cube", "box"},
    {"cuboid", "box"},
    {"sphere", "ball"},
    {"pill", "capsule"},
    {"tube", "cylinder"},
    {"floor", "plane"},
    {"terrain", "height_field"},
    {"heightmap", "height_field"},
    {"dem", "height_field"},
    {"obj", "mesh"},
    {"trimesh", "mesh"},
    {"lookat", "target"},
    {"look_at", "target"},
    {"at", "target"},
    {"to", "target"},
    {"from", "position"},
    {"eye", "position"},
    {"location", "position"},
    {"location", "center"},
    {"origin", "position"},
    {"origin", "center"},
    {"position", "center"},
    {"translate", "center"},
    {"center", "position"},
    {"field_of_view", "fov"},
    {"spp", "samples"},
    {"samples_per_pixel", "samples"},
    {"resolution", "width"},
    {"size", "width"},
    {"dimensions", "size"},
    {"extents", "size"},
    {"color", "albedo"},
    {"colour", "albedo"},
    {"reflectance", "albedo"},
    {"diffuse", "albedo"},
    {"material", "surface"},
    {"material", "model"},
    {"rho", "density"},
    {"e", "young_modulus"},
    {"nu", "poisson_ratio"},
    {"speed", "velocity"},
    {"intensity", "radiance"},
    {"intensity", "irradiance"},
    {"dt_max", "dt"},
    {"timestep", "dt"},
    {"time_step", "dt"},
    {"resolution", "particles_across"},
    {"framerate", "fps"},
    {"frame_rate", "fps"},
    {"bounces", "max_bounces"},
    {"max_depth", "max_bounces"},
    {"directional", "sun"},
    {"distant", "sun"},
    {"envmap", "image"},
    {"hdri", "image"},
    {"area", "quad"},
    {"ball", "sphere"},
    {"rect", "quad"},
    {"angle", "rotation"},
    {"rotate", "rotation"},
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string words(const std::string& name) { return ", did you mean '" + name + "'?"; }

}  // namespace

int edit_distance(const std::string& a, const std::string& b) {
  const int n = static_cast<int>(a.size()), m = static_cast<int>(b.size());
  std::vector<std::vector<int>> d(n + 1, std::vector<int>(m + 1));
  for (int i = 0; i <= n; ++i) d[i][0] = i;
  for (int j = 0; j <= m; ++j) d[0][j] = j;
  for (int i = 1; i <= n; ++i) {
    for (int j = 1; j <= m; ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[n][m];
}

std::string suggestion(const std::string& word, const std::vector<std::string>& names) {
  if (word.size() > kLongestWord) return "";
  for (const auto& [other, here] : kSynonyms) {
    if (lower_case(word) == other && contains(names, here)) return words(here);
  }
  const std::string* best = nullptr;
  int least =
      static_cast<int>(word.size()) / 3 + 2;  // one error more than a third of the letters is another word
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    if (distance < least && distance < static_cast<int>(name.size())) {
      least = distance;
      best = &name;
    }
  }
  return best ? words(*best) : "";
}

}  // namespace firn
