// SPDX-License-Identifier: MIT
#include "src/render/solids/scattering.h"

#include <algorithm>
#include <cmath>

#include "src/render/sampling/directions.h"
#include "src/render/solids/facet_energy.h"

namespace firn {
namespace {

constexpr float kSmoothest = 1e-3f;  // alpha: below it facets are told apart by rounding

// The surface as seen from wo: `n` is the normal on its side.
struct Side {
  Side(const SurfacePoint& surface, const Vec3f& wo)
      : outside(surface.normal.dot(wo) >= 0), n(outside ? surface.normal : Vec3f(-surface.normal)) {}
  bool outside;
  Vec3f n;
};

// ---- GGX in a frame whose z is the normal

float alpha_of(const SurfacePoint& surface) {
  return std::max(surface.roughness * surface.roughness, kSmoothest);
}

float square(float x) { return x * x; }

float facets(float alpha, const Vec3f& m) {  // D, 1/sr
  const float a2 = alpha * alpha;
  return a2 / (kPi * square(m.x() * m.x() + m.y() * m.y() + a2 * m.z() * m.z()));
}

float smith(float alpha, const Vec3f& w) {  // Lambda
  const float tan2 = (w.x() * w.x() + w.y() * w.y()) / (w.z() * w.z());
  return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
}

Vec3f schlick(const Vec3f& albedo, float cosine) {
  const float c = 1 - cosine, c5 = c * c * c * c * c;
  return albedo + c5 * (Vec3f::Ones() - albedo);
}

// A facet with the density by which w sees it (Heitz 2018, with his names).
Vec3f visible_facet(float alpha, const Vec3f& w, Sample2 at) {
  const Vec3f Vh = Vec3f(alpha * w.x(), alpha * w.y(), w.z()).normalized();
  const Disc disc = on_circle(std::sqrt(at.u), at.v);
  const float across = Vh.x() * Vh.x() + Vh.y() * Vh.y();
  const Vec3f T1 = across > 0 ? Vec3f(Vec3f(-Vh.y(), Vh.x(), 0) / std::sqrt(across)) : Vec3f::UnitX();
  const Vec3f T2(-Vh.z() * T1.y(), Vh.z() * T1.x(), Vh.x() * T1.y() - Vh.y() * T1.x());
  const float s = 0.5f * (1 + Vh.z()), t1 = disc.x;
  const float t2 = (1 - s) * std::sqrt(std::max(0.f, 1 - t1 * t1)) + s * disc.y;
  const Vec3f Nh = t1 * T1 + t2 * T2 + std::sqrt(std::max(0.f, 1 - t1 * t1 - t2 * t2)) * Vh;
  return Vec3f(alpha * Nh.x(), alpha * Nh.y(), std::max(0.f, Nh.z())).normalized();
}

// Two directions in the frame of the side that wo is on, and the facet that reflects one into the other.
struct Facet {
  Facet(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
    const Side side(surface, wo);
    o = toward(side.n, wo), i = toward(side.n, wi);
    valid = o.z() > 0 && i.z() > 0;
    if (valid) m = (o + i).normalized();
  }
  static Vec3f toward(const Vec3f& n, const Vec3f& w) {
    return {w.dot(around(n, 1, 0, 0)), w.dot(around(n, 0, 1, 0)), w.dot(n)};
  }
  Vec3f o, i, m;
  bool valid;
};

// Light that leaves after more than one facet, spread by what one facet loses (Kulla & Conty 2017).
Vec3f evaluate_more(const SurfacePoint& surface, const Facet& facet) {
  const float mean = mean_facet_energy(surface.roughness);
  if (!(mean < 1)) return Vec3f::Zero();
  const float lost = (1 - facet_energy(surface.roughness, facet.o.z())) *
                     (1 - facet_energy(surface.roughness, facet.i.z())) / (kPi * (1 - mean));
  const Vec3f once =
      (Vec3f::Ones() + 20 * surface.albedo) / 21;  // mean of Schlick's term over the hemisphere
  return lost * once.array().square() * mean / (1 - once.array() * (1 - mean));
}

Vec3f evaluate_glossy(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  const Facet facet(surface, wo, wi);
  if (!facet.valid) return Vec3f::Zero();
  const float alpha = alpha_of(surface);
  const float g2 = 1 / (1 + smith(alpha, facet.o) + smith(alpha, facet.i));
  return schlick(surface.albedo, std::min(facet.o.dot(facet.m), 1.f)) *
             (facets(alpha, facet.m) * g2 / (4 * facet.o.z() * facet.i.z())) +
         evaluate_more(surface, facet);
}

float density_glossy(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  const Facet facet(surface, wo, wi);
  if (!facet.valid) return 0;
  const float alpha = alpha_of(surface), once = facet_energy(surface.roughness, facet.o.z());
  return once * facets(alpha, facet.m) / (4 * facet.o.z() * (1 + smith(alpha, facet.o))) +
         (1 - once) * facet.i.z() / kPi;
}

// ---- What scatter() does for each kind

bool scatter_diffuse(const SurfacePoint& surface, const Vec3f& wo, Sample2 at, Scattered& out) {
  const Side side(surface, wo);
  const Vec3f wi = cosine_direction(side.n, at);
  out = {wi, surface.albedo, side.n.dot(wi) / kPi, side.n.dot(wo) / kPi, false};
  return out.pdf > 0;
}

bool scatter_mirror(const SurfacePoint& surface, const Vec3f& wo, Scattered& out) {
  const Vec3f& n = surface.normal;
  out = {(2 * n.dot(wo) * n - wo).normalized(), surface.albedo, 1, 1, true};
  return true;
}

bool scatter_glossy(const SurfacePoint& surface, const Vec3f& wo, float choice, Sample2 at, Scattered& out) {
  const Side side(surface, wo);
  const Vec3f o = Facet::toward(side.n, wo);
  if (!(o.z() > 0)) return false;
  if (choice < facet_energy(surface.roughness, o.z())) {
    const Vec3f m = visible_facet(alpha_of(surface), o, at), i = (2 * o.dot(m) * m - o).normalized();
    if (!(i.z() > 0)) return false;
    out.direction = around(side.n, i.x(), i.y(), i.z()).normalized();
  } else {
    out.direction = cosine_direction(side.n, at);
  }
  out.pdf = density_glossy(surface, wo, out.direction);
  out.pdf_reverse = density_glossy(surface, out.direction, wo);
  out.specular = false;
  if (!(out.pdf > 0)) return false;
  out.weight = evaluate_glossy(surface, wo, out.direction) * (std::fabs(side.n.dot(out.direction)) / out.pdf);
  return true;
}

bool scatter_dielectric(const SurfacePoint& surface, const Vec3f& wo, float choice, Carries carries,
                        Scattered& out) {
  const Side side(surface, wo);
  const float eta = side.outside ? surface.ior : 1 / surface.ior;  // of the far side, over this one
  const float cos_o = std::min(side.n.dot(wo), 1.f), sin2 = (1 - cos_o * cos_o) / (eta * eta);
  const float cos_t = std::sqrt(std::max(0.f, 1 - sin2));
  const float across = (cos_o - eta * cos_t) / (cos_o + eta * cos_t),
              along = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
  const float reflected = sin2 < 1 ? 0.5f * (across * across + along * along) : 1;
  if (choice < reflected) {
    out = {(2 * cos_o * side.n - wo).normalized(), Vec3f::Ones(), reflected, reflected, true};
    return true;
  }
  const float passed = 1 - reflected, weight = carries == Carries::radiance ? 1 / (eta * eta) : 1;
  const Vec3f wi = ((cos_o / eta - cos_t) * side.n - wo / eta).normalized();
  // n^2 cos dw is the same on both sides.
  out = {wi, Vec3f::Constant(weight), passed, passed * cos_o / (cos_t * eta * eta), true};
  return cos_t > 0;
}

}  // namespace

bool is_specular(const SurfacePoint& surface) {
  return surface.kind == SurfaceKind::mirror || surface.kind == SurfaceKind::dielectric ||
         surface.kind == SurfaceKind::none;
}

bool scatter(const SurfacePoint& surface, const Vec3f& wo, float choice, Sample2 at, Carries carries,
             Scattered& out) {
  switch (surface.kind) {
    case SurfaceKind::diffuse:
      return scatter_diffuse(surface, wo, at, out);
    case SurfaceKind::mirror:
      return scatter_mirror(surface, wo, out);
    case SurfaceKind::glossy:
      return scatter_glossy(surface, wo, choice, at, out);
    case SurfaceKind::dielectric:
      return scatter_dielectric(surface, wo, choice, carries, out);
    case SurfaceKind::emission:
      return false;
    case SurfaceKind::none:
      break;
  }
  out = {-wo, Vec3f::Ones(), 1, 1, true};
  return true;
}

Vec3f evaluate(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  if (surface.kind == SurfaceKind::glossy) return evaluate_glossy(surface, wo, wi);
  if (surface.kind != SurfaceKind::diffuse || !(Side(surface, wo).n.dot(wi) > 0)) return Vec3f::Zero();
  return surface.albedo / kPi;
}

float density(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  if (surface.kind == SurfaceKind::glossy) return density_glossy(surface, wo, wi);
  if (surface.kind != SurfaceKind::diffuse) return 0;
  return std::max(0.f, Side(surface, wo).n.dot(wi)) / kPi;
}

}  // namespace firn
