// SPDX-License-Identifier: MIT
#include "src/render/solids/facet_energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr int kRoughnesses = 33, kCosines = 33;  // knots from 0 to 1
constexpr int kRings = 64, kTurns = 16;          // facets of each

double square(double x) { return x * x; }

// Smith's Lambda.
double shadow(double alpha, double cosine) {
  return 0.5 * (std::sqrt(1 + square(alpha) * (1 / square(cosine) - 1)) - 1);
}

// The mean of G2 / G1 over the facets that are seen from (sine, 0, cosine), as the disc of Heitz 2018 has
// them.
double integral(double alpha, double cosine) {
  const double sine = std::sqrt(1 - square(cosine)),
               length = std::sqrt(square(alpha * sine) + square(cosine));
  const double x = alpha * sine / length, z = cosine / length, s = 0.5 * (1 + z);
  double sum = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    // Rings crowd towards the rim, where the steep facets of the long tail are.
    const double from_rim = 1 - (ring + 0.5) / kRings;
    const double r = std::sqrt(1 - from_rim * from_rim * from_rim), share = 3 * square(from_rim);
    for (int turn = 0; turn < kTurns; ++turn) {
      const SinCos angle = portable_sincos(6.28318530717958647692 * (turn + 0.5) / kTurns);
      const double t1 = r * angle.cos, t2 = (1 - s) * std::sqrt(1 - square(t1)) + s * r * angle.sin;
      const double up = std::sqrt(std::max(0.0, 1 - square(t1) - square(t2)));
      // T1 = (0, 1, 0), T2 = (-z, 0, x) in the stretched frame.
      const double nx = alpha * (x * up - z * t2), ny = alpha * t1, nz = std::max(0.0, z * up + x * t2);
      const double norm = std::sqrt(square(nx) + square(ny) + square(nz));
      const double i = 2 * (sine * nx + cosine * nz) / norm * nz / norm - cosine;  // the cosine behind
      if (i <= 0) continue;
      sum += share * (1 + shadow(alpha, cosine)) / (1 + shadow(alpha, cosine) + shadow(alpha, i));
    }
  }
  return sum / (kRings * kTurns);
}

struct Table {
  std::array<std::array<float, kCosines>, kRoughnesses> energy;
  std::array<float, kRoughnesses> mean;

  Table() {
    energy[0].fill(1);
    mean[0] = 1;
    for (int row = 1; row < kRoughnesses; ++row) {
      const double alpha = square(row / (kRoughnesses - 1.0));
      for (int k = 0; k < kCosines; ++k)
        energy[row][k] = static_cast<float>(integral(alpha, std::max(k / (kCosines - 1.0), 1e-3)));
      // The integral of 2 cosine x, x as the table has it: linear between knots.
      double sum = 0;
      for (int k = 0; k + 1 < kCosines; ++k) {
        const double low = k / (kCosines - 1.0), step = 1 / (kCosines - 1.0);
        const double first = energy[row][k], rise = energy[row][k + 1] - first;
        sum += 2 * step * (first * (low + step / 2) + rise * (low / 2 + step / 3));
      }
      mean[row] = static_cast<float>(sum);
    }
  }
};

const Table& table() {
  static const Table table;
  return table;
}

struct Knot {
  Knot(float x, int knots) {
    const float at = std::clamp(x, 0.f, 1.f) * static_cast<float>(knots - 1);
    low = std::min(static_cast<int>(at), knots - 2);
    part = at - static_cast<float>(low);
  }
  int low;
  float part;
};

float between(float a, float b, float part) { return a + part * (b - a); }

}  // namespace

float facet_energy(float roughness, float cosine) {
  const Knot row(roughness, kRoughnesses), k(cosine, kCosines);
  const auto at = [&](int r) {
    const auto& values = table().energy[static_cast<std::size_t>(r)];
    return between(values[static_cast<std::size_t>(k.low)], values[static_cast<std::size_t>(k.low) + 1],
                   k.part);
  };
  return between(at(row.low), at(row.low + 1), row.part);
}

// Linear in roughness as facet_energy() is, so that the two agree.
float mean_facet_energy(float roughness) {
  const Knot row(roughness, kRoughnesses);
  const auto at = [](int r) { return table().mean[static_cast<std::size_t>(r)]; };
  return between(at(row.low), at(row.low + 1), row.part);
}

}  // namespace firn
