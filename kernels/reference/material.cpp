// SPDX-License-Identifier: MIT
// Stress, energy and yield by the twin of each material, and what the twins share.
#include <cmath>

#include "kernels/materials/list.h"
#include "kernels/reference/mpm.h"

namespace firn::kernels::reference {

void times_transpose(const double a[9], const double b[9], double out[9]) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      out[3 * r + c] = 0;
      for (int k = 0; k < 3; ++k) out[3 * r + c] += a[3 * r + k] * b[3 * c + k];
    }
  }
}

void compose(const double u[9], const double s[3], const double v[9], double out[9]) {
  double us[9];
  for (int k = 0; k < 9; ++k) us[k] = u[k] * s[k % 3];
  times_transpose(us, v, out);
}

double norm2(const double a[9]) {
  double sum = 0;
  for (int k = 0; k < 9; ++k) sum += a[k] * a[k];
  return sum;
}

double clamped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

double stretch2_bound(const double f[9]) { return std::fmax(1, norm2(f) - 2); }

bool clamp_stretches(const SharedParams& p, double f[9], double& jp) {
  double u[9], s[3], v[9];
  svd(f, u, s, v);
  double before = 1, after = 1;
  bool changed = false;
  for (double& sigma : s) {
    const double inside = clamped(sigma, p.sigma_min, p.sigma_max);
    changed = changed || inside != sigma;
    before *= sigma;
    after *= inside;
    sigma = inside;
  }
  if (!changed) return false;
  compose(u, s, v, f);
  jp = clamped(jp * before / after, p.jp_min, p.jp_max);
  return true;
}

namespace {

// Calls f(Twin()) with the twin of this kind.
template <class F>
void with_twin(MaterialKind kind, F&& f) {
  AllMaterials::visit(kind, [&](auto material) { f(Twin<decltype(material)>()); });
}

}  // namespace

void stress(const MaterialParams& p, const double f[9], double jp, double tau[9]) {
  with_twin(p.kind, [&](auto twin) { twin.stress(p, f, jp, tau); });
}

double energy(const MaterialParams& p, const double f[9], double jp) {
  double result = 0;
  with_twin(p.kind, [&](auto twin) { result = twin.energy(p, f, jp); });
  return result;
}

double wave_speed2(const MaterialParams& p, const double f[9], double jp) {
  double result = 0;
  with_twin(p.kind, [&](auto twin) { result = twin.wave_speed2(p, f, jp); });
  return result;
}

bool project(const MaterialParams& p, double f[9], double& jp) {
  bool changed = false;
  with_twin(p.kind, [&](auto twin) { changed = twin.project(p, f, jp); });
  return changed;
}

}  // namespace firn::kernels::reference
