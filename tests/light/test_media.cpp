// SPDX-License-Identifier: MIT
// Homogeneous media against transport theory. By reciprocity the part of a beam that a slab reflects is the
// radiance that it shows in the beam's direction under uniform light from that side; what it lets through,
// under light from the other side.
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "src/core/rng.h"
#include "src/render/directions.h"
#include "src/render/ice.h"
#include "src/render/media.h"
#include "src/render/phase.h"
#include "tests/catch.h"
#include "tests/light/estimate.h"
#include "tests/light/reference_table.h"

using namespace firn;
using namespace firn::test;

namespace {

// Opaque and black, on one side of a horizontal plane.
void add_black_half(RenderSetup& setup, double height, bool above) {
  Shape plane = floor_plane(height);
  if (above) plane.pose.rotation = Vec3(1, -1, -1).asDiagonal();
  add_object(setup, plane, add_surface(setup, SurfaceKind::diffuse, 0));
}

// 1 m thick, its upper side at height 0.
Medium slab(double albedo, double g, double tau) {
  Medium medium;
  medium.shape = floor_plane(0);
  const bool thick = std::isinf(tau);
  const double sigma = thick ? 1 : tau;
  if (!thick) medium.thickness = 1;
  medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma * albedo));
  medium.sigma_a = Vec3f::Constant(static_cast<float>(sigma * (1 - albedo)));
  medium.g = static_cast<float>(g);
  return medium;
}

RenderSetup slab_setup(const Medium& medium, Integrator integrator = Integrator::path) {
  RenderSetup setup = empty_setup(Vec3(0, 1, 0), Vec3::Zero(), 1, 1, 1, 100000);
  setup.image.integrator = integrator;
  setup.media.push_back(medium);
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  return setup;
}

Estimate reflected(const Medium& medium, double mu, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  if (std::isfinite(medium.thickness)) add_black_half(setup, -1.1, false);
  const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
  return radiance_along(setup, {}, from, Vec3::Zero(), side, samples);
}

Estimate transmitted(const Medium& medium, double mu, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  add_black_half(setup, 1.5, true);
  const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
  return radiance_along(setup, {}, from, Vec3::Zero(), side, samples);
}

// Light that falls on a slab from all sides alike: a tiny white face over it, in a scene of `of`, sees the
// mean.
Estimate seen_by_a_face(RenderSetup setup, int side, int samples) {
  Shape box;
  box.form = Box{Vec3::Constant(5e-4)};
  box.pose.translation = Vec3(0, 1 + 5e-4, 0);
  add_object(setup, box, add_surface(setup, SurfaceKind::diffuse, 1));
  return radiance_along(setup, {}, Vec3(0, 0.9, 0), Vec3(0, 1, 0), side, samples);
}
Estimate reflected_diffuse(const Medium& medium, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  if (std::isfinite(medium.thickness)) add_black_half(setup, -1.1, false);
  return seen_by_a_face(setup, side, samples);
}
Estimate transmitted_diffuse(const Medium& medium, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  add_black_half(setup, 1.5, true);
  return seen_by_a_face(setup, side, samples);
}

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

// Random numbers of one walk.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : seed_(seed) {}
  std::uint64_t key() { return mix64(seed_ + 0x9e3779b97f4a7c15ull * ++count_); }
  Sample2 pair() {
    const std::uint64_t bits = key();
    return {static_cast<float>(bits >> 40) * 0x1p-24f, static_cast<float>(bits >> 8 & 0xffffff) * 0x1p-24f};
  }

 private:
  std::uint64_t seed_, count_ = 0;
};

// Of `size` values that walk(photon) gives, by many photons; the same for any number of threads.
template <class Walk>
std::vector<Estimate> means_of(std::uint64_t photons, Eigen::Index size, const Walk& walk) {
  constexpr std::uint64_t kChunks = 64;
  const Eigen::ArrayXd zero = Eigen::ArrayXd::Zero(size);
  std::vector<Eigen::ArrayXd> sums(kChunks, zero), squares(kChunks, zero);
  tbb::parallel_for(std::uint64_t{0}, kChunks, [&](std::uint64_t chunk) {
    for (std::uint64_t photon = chunk; photon < photons; photon += kChunks) {
      const Eigen::ArrayXd value = walk(photon);
      sums[chunk] += value;
      squares[chunk] += value.square();
    }
  });
  Eigen::ArrayXd sum = zero, square = zero;
  for (std::uint64_t chunk = 0; chunk < kChunks; ++chunk) sum += sums[chunk], square += squares[chunk];
  std::vector<Estimate> means;
  const auto n = static_cast<double>(photons);
  for (Eigen::Index k = 0; k < size; ++k) {
    const double mean = sum[k] / n;
    means.push_back({mean, std::sqrt(std::max(square[k] / n - mean * mean, 0.0) / n)});
  }
  return means;
}
template <class Walk>
Estimate mean_of(std::uint64_t photons, const Walk& walk) {
  return means_of(photons, 1,
                  [&](std::uint64_t photon) { return Eigen::ArrayXd::Constant(1, walk(photon)); })[0];
}

constexpr int kSide = 16;
constexpr int kSlabSamples = 24;  // a pixel: 6144 paths a number

}  // namespace

TEST_CASE("slabs reflect and let through what adding-doubling says", "[light]") {
  Scores scores;
  for (auto& row : reference_table("slab_rt_matched")) {
    const Medium medium = slab(number(row["a"]), number(row["g"]), number(row["tau"]));
    const auto check = [&](const std::string& name, const Estimate& seen) {
      const double expected = number(row[name]);
      INFO("a " << row["a"] << " g " << row["g"] << " tau " << row["tau"] << " " << name << ": " << seen.mean
                << " +- " << seen.error << ", expected " << expected);
      // Light that one path in a hundred thousand brings has no error bar of its own.
      CHECK(std::fabs(seen.mean - expected) < 4.5 * std::max(seen.error, 1e-4));
      if (seen.error > 1e-4) scores.add(seen.mean, expected, seen.error);
    };
    const bool ends = row["tau"] != "inf";
    for (const bool steep : {true, false}) {
      const double mu = steep ? 1 : 0.5;
      const std::string tail = steep ? "mu0_1" : "mu0_05";
      check("R_" + tail, reflected(medium, mu, kSide, kSlabSamples));
      if (ends) check("T_" + tail, transmitted(medium, mu, kSide, kSlabSamples));
    }
    check("R_diffuse", reflected_diffuse(medium, kSide, kSlabSamples));
    if (ends) check("T_diffuse", transmitted_diffuse(medium, kSide, kSlabSamples));
  }
  require_unbiased(scores);
}

TEST_CASE("a half space of isotropic scatterers shines as Chandrasekhar's H functions", "[light]") {
  // Albedo of the plane, as its radiance under uniform light; and the radiance at mu under a beam from mu0 =
  // 0.7: L = a / (4 pi) mu0 / (mu + mu0) H(mu) H(mu0) for a beam of unit irradiance across itself.
  std::map<std::string, std::map<std::string, double>> h;
  Scores scores;
  for (auto& row : reference_table("hfunction_isotropic")) {
    if (row["mu"] == "diffuse") continue;
    h[row["a"]][row["mu"]] = number(row["H"]);
    // Nearer to 1 walks are longer, up to 1000 collisions in the mean, and have less to tell.
    const Estimate seen = reflected(slab(number(row["a"]), 0, INFINITY), number(row["mu"]), kSide,
                                    number(row["a"]) > 0.995 ? 4 : 16);
    INFO("a " << row["a"] << " mu " << row["mu"] << ": " << seen.mean << " +- " << seen.error);
    scores.add(seen.mean, number(row["plane_albedo"]), seen.error);
  }
  for (auto& [a, of] : h) {
    RenderSetup setup = slab_setup(slab(number(a), 0, INFINITY));
    setup.lights = {SunLight{Vec3(-std::sqrt(1 - 0.49), 0.7, 0), 0.01, Vec3f::Ones()}};
    for (auto& [mu, value] : of) {
      const double m = number(mu);
      const Estimate seen = radiance_along(setup, {}, Vec3(0, m, std::sqrt(1 - m * m)), Vec3::Zero(), kSide,
                                           number(a) > 0.995 ? 4 : 32);
      const double expected = number(a) / (4 * kPi) * 0.7 / (m + 0.7) * value * of["0.7"];
      INFO("a " << a << " mu " << mu << ": " << seen.mean << " +- " << seen.error << ", expected "
                << expected);
      CHECK(std::fabs(seen.mean - expected) < 4.5 * seen.error);
      scores.add(seen.mean, expected, seen.error);
    }
  }
  require_unbiased(scores);
}

TEST_CASE("in a white furnace a medium that absorbs nothing cannot be seen", "[light]") {
  Scores scores;
  for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
    for (const double sigma : {0.5, 10.0, 200.0}) {
      for (const double g : {-0.5, 0.0, 0.9}) {
        Medium medium;
        medium.shape.form = Ball{0.2};
        medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
        medium.g = static_cast<float>(g);
        RenderSetup setup = slab_setup(medium, integrator);
        const Estimate seen = radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, 64);
        INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
        CHECK(std::fabs(seen.mean - 1) <= std::max(3.5 * seen.error, 1e-4));
        CHECK(seen.error < 6e-3);
        scores.add(seen.mean, 1, std::max(seen.error, 1e-6));
        setup.media[0].sigma_a = Vec3f::Constant(0.1f * static_cast<float>(sigma));
        CHECK(radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, 64).mean < 0.99);
      }
    }
  }
  require_unbiased(scores);
}

TEST_CASE("light walks 4V/S through a convex body that scatters, whatever is in it", "[light]") {
  // Light from all sides enters a ball evenly over its surface, cosine-distributed.
  Scores scores;
  for (const double sigma : {0.5, 5.0, 50.0}) {
    for (const double g : {0.0, 0.8}) {
      Medium medium;
      medium.shape.form = Ball{1};
      medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
      medium.g = static_cast<float>(g);
      MediumSet media({medium});
      media.place(Vec3::Zero());
      const auto walk = [&](std::uint64_t photon) {
        Draws draws(hash_keys(5, photon));
        Vec3f p(0, 0, 1), d = cosine_direction(Vec3f(0, 0, -1), draws.pair());
        double length = 0;
        for (;;) {
          const auto flight = media.fly(p, d, INFINITY, draws.key());
          if (flight.medium < 0) {
            const double along = p.cast<double>().dot(d.cast<double>());
            return length - along +
                   std::sqrt(std::max(along * along - p.cast<double>().squaredNorm() + 1, 0.0));
          }
          length += flight.t;
          p += flight.t * d;
          d = phase_direction(medium.g, d, draws.pair());
        }
      };
      const Estimate seen = mean_of(sigma > 10 ? 1 << 20 : 1 << 18, walk);
      INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
      CHECK(seen.mean == Approx(4.0 / 3).epsilon(0.005));
      CHECK(seen.error < 0.005 * 4 / 3);
      scores.add(seen.mean, 4.0 / 3, seen.error);
    }
  }
  require_unbiased(scores);
}

TEST_CASE("deep snow reflects by wavelength and grain what adding-doubling says", "[light]") {
  // Natural grains: walks with the true phase function, their collisions counted; each wavelength loses
  // 1 - albedo^n of a walk of n collisions, as the path tracer has it by the ice. A walk that has been long
  // goes on by chance: whenever its length has grown fourfold, half of them do, and count twice from there
  // on.
  std::vector<std::map<std::string, std::string>> rows;
  for (auto& row : reference_table("snow_albedo_semiinf")) {
    if (row["model"] != "mie_sphere") rows.push_back(row);
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::ArrayXd log_albedo(count);
  for (Eigen::Index k = 0; k < count; ++k) log_albedo[k] = std::log1p(-number(rows[k]["coalbedo"]));
  const Medium snow = slab(1, kNaturalAnisotropy, INFINITY);
  MediumSet media({snow});
  media.place(Vec3::Zero());
  Scores scores;
  for (const std::string incidence : {"R_mu0_1", "R_mu0_05", "R_diffuse"}) {
    const auto walk = [&](std::uint64_t photon) {
      Draws draws(hash_keys(6, photon));
      Vec3f p = Vec3f::Zero(), d(0, -1, 0);
      if (incidence == "R_mu0_05") d = Vec3f(std::sqrt(0.75f), -0.5f, 0);
      if (incidence == "R_diffuse") d = cosine_direction(Vec3f(0, -1, 0), draws.pair());
      Eigen::ArrayXd left = Eigen::ArrayXd::Ones(count), lost = Eigen::ArrayXd::Zero(count);
      double weight = 1, collisions = 0;
      const auto lose = [&] {
        const Eigen::ArrayXd now = (collisions * log_albedo).exp();
        lost += weight * (left - now);
        left = now;
      };
      for (double next = 1000;;) {
        const auto flight = media.fly(p, d, INFINITY, draws.key());
        if (flight.medium < 0) break;
        p.y() += flight.t * d.y();  // depth alone matters
        d = phase_direction(snow.g, d, draws.pair());
        if (++collisions < next) continue;
        lose();
        if (draws.pair().u < 0.5f) return lost;
        weight *= 2, next *= 4;
      }
      lose();
      return lost;
    };
    const std::vector<Estimate> lost = means_of(1 << 18, count, walk);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double expected = number(rows[k][incidence]);
      INFO(rows[k]["k_source"] << " " << rows[k]["lambda_nm"] << " nm, " << rows[k]["r0_um"] << " um, "
                               << incidence << ": " << 1 - lost[k].mean << " +- " << lost[k].error
                               << ", expected " << expected);
      CHECK(std::fabs(1 - lost[k].mean - expected) < std::max(1e-3, 3 * lost[k].error));
      CHECK(lost[k].error < 1e-3);
      scores.add(1 - lost[k].mean, expected, lost[k].error);
    }
  }
  // One set of walks has all wavelengths, so the scores go together.
  CHECK(scores.largest() < 4.5);
}

TEST_CASE("a photon collides (1 - R) / (1 - albedo) times in a half space", "[light]") {
  // Analog: a photon survives a collision with the chance of the albedo. Absorbed ones are those that did not
  // leave.
  for (const double albedo : {0.5, 0.9, 0.99}) {
    MediumSet media({slab(albedo, 0.75, INFINITY)});
    media.place(Vec3::Zero());
    constexpr int kPhotons = 20000;
    double collisions = 0, squares = 0;
    int left = 0;
    std::uint64_t key = 77;
    for (int photon = 0; photon < kPhotons; ++photon) {
      Vec3f p = Vec3f::Zero(), d(0, -1, 0);
      int n = 0;
      for (;;) {
        const auto found = media.fly(p, d, INFINITY, mix64(key++));
        if (found.medium < 0) {
          ++left;
          break;
        }
        p += found.t * d;
        ++n;
        if (uniform_double(mix64(key++)) >= albedo) break;
        d = phase_direction(0.75f, d, {uniform_float(mix64(key)), uniform_float(mix64(key + 1))});
        key += 2;
      }
      collisions += n;
      squares += static_cast<double>(n) * n;
    }
    const double mean = collisions / kPhotons, reflected_part = static_cast<double>(left) / kPhotons;
    const double error = std::sqrt((squares / kPhotons - mean * mean) / kPhotons) +
                         std::sqrt(reflected_part * (1 - reflected_part) / kPhotons) / (1 - albedo);
    INFO("albedo " << albedo);
    CHECK(std::fabs(mean - (1 - reflected_part) / (1 - albedo)) < 3 * error);
  }
}
