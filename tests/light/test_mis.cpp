// SPDX-License-Identifier: MIT
// The weights of all ways to find one path, put together from trails as the integrator does it, against the
// definition: p_s^2 over the sum of all p_i^2.
#include <vector>

#include "src/core/rng.h"
#include "src/render/paths/mis.h"
#include "tests/catch.h"

namespace firn::test::mis {
namespace {

// A path of vertices 0 (on the light) to n - 1 (the camera) with made-up densities.
struct Made {
  int n = 0;
  std::vector<double> by_light, by_eye;  // density of each vertex, sampled from either side
  std::vector<bool> specular;
  double emitted = 1;  // of vertices 0 and 1 together, by a light subpath
  double chosen = 1;   // of vertex 0, by a vertex that is to be lit
  double pixels = 1;   // light subpaths for each pixel's eye subpath

  bool can(int s) const {  // s vertices from the light: does its connecting edge exist?
    if (s == 0) return true;
    if (s == n) return false;
    return !specular[static_cast<std::size_t>(s - 1)] && !specular[static_cast<std::size_t>(s)];
  }
  double density(int s) const {
    double p = s == 0 ? 1 : s == 1 ? chosen : emitted;
    for (int i = 2; i < s; ++i) p *= by_light[static_cast<std::size_t>(i)];
    for (int i = s; i < n - 1; ++i) p *= by_eye[static_cast<std::size_t>(i)];
    return s == n - 1 ? p * pixels : p;
  }
};

Made make(int n, std::uint64_t key) {
  Made path;
  path.n = n;
  const auto draw = [&key] { return 0.05 + 3 * uniform_double(mix64(key++)); };
  for (int i = 0; i < n; ++i) {
    path.by_light.push_back(draw());
    path.by_eye.push_back(draw());
    // Ends are never specular, and the eye's first vertex only where it must be left to other ways.
    path.specular.push_back(i > 0 && i < n - 1 && uniform_double(mix64(key++)) < 0.25);
  }
  path.emitted = draw();
  path.chosen = draw();
  path.pixels = 1 + 10 * draw();
  return path;
}

// Vertices n - 2 down to `last`, as an eye subpath arrives at them.
Trail eye_trail(const Made& path, int last) {
  Trail trail;
  for (int i = path.n - 2; i >= last; --i) {
    const auto at = static_cast<std::size_t>(i);
    const bool bad = path.specular[at] || path.specular[at + 1];
    // Leaving vertex i + 1 for i, the light's density of i + 2 becomes known.
    if (i + 2 <= path.n - 2) trail.leave(static_cast<float>(path.by_light[at + 2]));
    const double meets = i == path.n - 2 ? path.pixels : 1;
    trail.arrive(static_cast<float>(path.by_eye[at]), 1, bad ? 0.f : static_cast<float>(meets));
  }
  return trail;
}

Trail light_trail(const Made& path, int last) {
  Trail trail;
  trail.arrive(1, 0, 1);
  for (int i = 1; i <= last; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool bad = path.specular[at] || path.specular[at - 1];
    if (i >= 2) trail.leave(static_cast<float>(path.by_eye[at - 2]));
    const double density = i == 1 ? path.emitted : path.by_light[at], meets = i == 1 ? path.chosen : 1;
    trail.arrive(static_cast<float>(density), 1, bad ? 0.f : static_cast<float>(meets));
  }
  return trail;
}

double light_density(const Made& path, int i) { return path.by_light[static_cast<std::size_t>(i)]; }
double eye_density(const Made& path, int i) { return path.by_eye[static_cast<std::size_t>(i)]; }

double weight(const Made& path, int s) {
  const int n = path.n;
  double others = 0;
  if (s == 0) {
    Trail trail = eye_trail(path, 1);
    if (n > 3) trail.leave(static_cast<float>(light_density(path, 2)));
    const bool meets = !path.specular[1] && n > 2;
    trail.arrive(static_cast<float>(eye_density(path, 0)), 1, meets ? static_cast<float>(path.chosen) : 0.f);
    others = trail.others(1, static_cast<float>(path.emitted), n);
  } else if (s == 1) {
    const double found = eye_density(path, 0) / path.chosen;
    others = found * found;
    if (n > 2) {
      const Trail trail = eye_trail(path, 1);
      others += trail.others(static_cast<float>(path.emitted / path.chosen),
                             static_cast<float>(n > 3 ? light_density(path, 2) : 0), n);
    }
  } else {
    const Trail light = light_trail(path, s - 1);
    double end = eye_density(path, s - 1);
    if (s == n - 1) end /= path.pixels;
    others = light.others(static_cast<float>(end), static_cast<float>(eye_density(path, s - 2)), s);
    if (s < n - 1) {
      const Trail eye = eye_trail(path, s);
      others += eye.others(static_cast<float>(light_density(path, s)),
                           static_cast<float>(s + 1 <= n - 2 ? light_density(path, s + 1) : 0), n);
    }
  }
  return 1 / (1 + others);
}

}  // namespace

TEST_CASE("the weights of all ways to find a path sum to one", "[light]") {
  for (std::uint64_t key = 0; key < 400; ++key) {
    const Made path = make(3 + static_cast<int>(key % 6), 1000 * key);
    double sum = 0, squares = 0;
    for (int s = 0; s < path.n; ++s) {
      if (path.can(s)) squares += path.density(s) * path.density(s);
    }
    for (int s = 0; s < path.n; ++s) {
      if (!path.can(s)) continue;
      const double expected = path.density(s) * path.density(s) / squares, w = weight(path, s);
      INFO("path " << key << ", " << path.n << " vertices, " << s << " from the light");
      CHECK(w == Approx(expected).margin(1e-5));
      sum += w;
    }
    CHECK(sum == Approx(1).margin(1e-5));
  }
}

}  // namespace firn::test::mis
