// SPDX-License-Identifier: MIT
#include "src/render/snow/ice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr int kWavelengths = 31;
constexpr double kShortest = 400, kStep = 10;  // nm
using Spectrum = std::array<double, kWavelengths>;

// Imaginary part of the refractive index of ice at 266 K. Tables of the two papers; Warren and Brandt's by
// way of refractiveindex.info (CC0).
constexpr Spectrum kPicard = {
    5.8150e-10, 5.5638e-10, 5.3291e-10, 5.6019e-10, 5.8820e-10, 6.4103e-10, 6.9729e-10, 7.8214e-10,
    8.7520e-10, 1.0067e-09, 1.1546e-09, 1.3480e-09, 1.5690e-09, 1.8493e-09, 2.1731e-09, 2.5995e-09,
    3.0995e-09, 3.6588e-09, 4.3065e-09, 5.0960e-09, 5.7300e-09, 6.8900e-09, 8.5800e-09, 1.0400e-08,
    1.2200e-08, 1.4300e-08, 1.6600e-08, 1.8900e-08, 2.0900e-08, 2.4000e-08, 2.9000e-08,
};
constexpr Spectrum kWarrenBrandt = {
    2.3650e-11, 2.6690e-11, 3.1350e-11, 4.1400e-11, 6.2680e-11, 9.2390e-11, 1.3250e-10, 1.9560e-10,
    2.8610e-10, 4.1720e-10, 5.8890e-10, 8.0360e-10, 1.0760e-09, 1.4090e-09, 1.8130e-09, 2.2890e-09,
    2.8390e-09, 3.4610e-09, 4.1590e-09, 4.9300e-09, 5.7300e-09, 6.8900e-09, 8.5800e-09, 1.0400e-08,
    1.2200e-08, 1.4300e-08, 1.6600e-08, 1.8900e-08, 2.0900e-08, 2.4000e-08, 2.9000e-08,
};

// CIE standard illuminant D65, relative power (CIE 15:2004, table T.1).
constexpr Spectrum kDaylight = {
    82.7549, 91.486,  93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354,
    107.802, 104.79,  107.689, 104.405, 104.046, 100,     96.3342, 95.788,  88.6856, 90.0062, 89.5991,
    87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
};

double wavelength(int i) { return kShortest + kStep * i; }

double absorption(IceSource data, int i) {
  const Spectrum& k = data == IceSource::picard ? kPicard : kWarrenBrandt;
  return 4e9 * 3.14159265358979323846 * k[i] / wavelength(i);
}

double lobe(double x, double center, double below, double above) {
  const double t = (x - center) / (x < center ? below : above);
  return portable_exp(-0.5 * t * t);
}

// CIE 1931 colour matching: the multi-lobe fit of Wyman, Sloan, Shirley 2013, "Simple analytic approximations
// to the CIE XYZ color matching functions", J. Computer Graphics Techniques 2(2), figure 4.
Vec3 matching(double nm) {
  return {1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
              0.065 * lobe(nm, 501.1, 20.4, 26.2),
          0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1),
          1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8)};
}

// Share of each wavelength of daylight in linear sRGB (IEC 61966-2-1). What the fit and the ends of the table
// leave of a cast, 0.0015, is scaled away.
std::array<Vec3, kWavelengths> find_shares() {
  Mat3 to_rgb;
  to_rgb << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259,
      1.0572252;
  std::array<Vec3, kWavelengths> share;
  Vec3 white = Vec3::Zero();
  for (int i = 0; i < kWavelengths; ++i) {
    share[i] = to_rgb * (kDaylight[i] * matching(wavelength(i)));
    white += share[i];
  }
  for (Vec3& s : share) s = s.cwiseQuotient(white);
  return share;
}

// Knots of the table: each doubling of (way + kStart) is cut into 64 parts, so that a float's own bits are
// the index. The last lies at 16 km, where nothing is left.
constexpr float kStart = 0.25f;  // m
constexpr int kPartBits = 6, kDoublings = 16;
constexpr int kShift = 23 - kPartBits;
constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(kStart) >> kShift;
constexpr std::uint32_t kLast = kDoublings << kPartBits;

}  // namespace

double ice_absorption(IceSource data, double wavelength_nm) {
  const double at = std::clamp((wavelength_nm - kShortest) / kStep, 0.0, kWavelengths - 1.0);
  const int i = std::min(static_cast<int>(at), kWavelengths - 2);
  const double low = absorption(data, i), high = absorption(data, i + 1);
  return low + (at - i) * (high - low);
}

Vec3 color_of(IceSource data, const std::function<double(double)>& kept) {
  static const auto shares = find_shares();
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < kWavelengths; ++i) sum += kept(absorption(data, i)) * shares[i];
  return sum;
}

Vec3 ice_color(IceSource data, double ice_path) {
  return color_of(data, [ice_path](double absorption) { return portable_exp(-absorption * ice_path); });
}

IceTint::IceTint(IceSource data) : table_(kLast + 1) {
  for (std::uint32_t knot = 0; knot <= kLast; ++knot) {
    const double way = std::bit_cast<float>((kFirst + knot) << kShift) - kStart;
    table_[knot] = ice_color(data, way).cast<float>();
  }
}

Vec3f IceTint::operator()(float ice_path) const {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(std::max(ice_path, 0.f) + kStart);
  const std::uint32_t knot = (bits >> kShift) - kFirst;
  if (knot >= kLast) return table_[kLast];
  const float part = static_cast<float>(bits & ((1u << kShift) - 1)) * (1.f / (1u << kShift));
  return table_[knot] + part * (table_[knot + 1] - table_[knot]);
}

}  // namespace firn
