// SPDX-License-Identifier: MIT
#include "src/render/scattering.h"

#include <cmath>

#include "src/render/directions.h"

namespace firn {
namespace {

// ---- GGX, with directions in the surface's frame: z along the normal, on the side of wo

struct Gloss {
  float alpha2;

  float distribution(float hz) const {
    const float base = hz * hz * (alpha2 - 1) + 1;
    return alpha2 / (kPi * base * base);
  }
  // Smith's Lambda.
  float hidden(float z) const {
    const float z2 = z * z;
    return 0.5f * (std::sqrt(1 + alpha2 * (1 - z2) / z2) - 1);
  }
};

Gloss gloss_of(const SurfacePoint& surface) {
  const float alpha = std::fmax(surface.roughness * surface.roughness, 1e-3f);
  return {alpha * alpha};
}

Vec3f schlick(const Vec3f& albedo, float cosine) {
  const float c = 1 - cosine, c2 = c * c;
  return albedo + (Vec3f::Ones() - albedo) * (c2 * c2 * c);
}

// The normals that wo sees (Heitz 2018, section 3.2), wo in the frame of n.
Vec3f visible_normal(float alpha, const Vec3f& wo, Sample2 at) {
  const Vec3f v = Vec3f(alpha * wo.x(), alpha * wo.y(), wo.z()).normalized();
  const float flat = v.x() * v.x() + v.y() * v.y();
  const Vec3f t1 = flat > 0 ? Vec3f(Vec3f(-v.y(), v.x(), 0) / std::sqrt(flat)) : Vec3f(1, 0, 0);
  const Vec3f t2 = v.cross(t1);
  const Disc disc = on_circle(std::sqrt(at.u), at.v);
  const float s = 0.5f * (1 + v.z());
  const float y = (1 - s) * std::sqrt(std::fmax(1 - disc.x * disc.x, 0.f)) + s * disc.y;
  const float z = std::sqrt(std::fmax(1 - disc.x * disc.x - y * y, 0.f));
  const Vec3f n = disc.x * t1 + y * t2 + z * v;
  return Vec3f(alpha * n.x(), alpha * n.y(), std::fmax(n.z(), 1e-6f)).normalized();
}

// The normal on the side of wo.
Vec3f facing(const SurfacePoint& surface, const Vec3f& wo) {
  return surface.normal.dot(wo) < 0 ? Vec3f(-surface.normal) : surface.normal;
}

struct Facets {  // of a glossy reflection
  float z_out, z_in, z_half, along;
  bool above;
};
Facets facets(const Vec3f& n, const Vec3f& wo, const Vec3f& wi) {
  const Vec3f half = (wo + wi).normalized();
  const float z_out = n.dot(wo), z_in = n.dot(wi);
  return {z_out, z_in, n.dot(half), wo.dot(half), z_out > 0 && z_in > 0};
}

// Reflected part of unpolarised light at a smooth boundary; `ratio`: index behind it over index before it.
// `inside` is the cosine of the refracted ray.
float fresnel(float cosine, float ratio, float& inside) {
  const float sin2 = (1 - cosine * cosine) / (ratio * ratio);
  if (sin2 >= 1) return 1;
  inside = std::sqrt(1 - sin2);
  const float s = (cosine - ratio * inside) / (cosine + ratio * inside),
              p = (ratio * cosine - inside) / (ratio * cosine + inside);
  return 0.5f * (s * s + p * p);
}

bool scatter_dielectric(const SurfacePoint& surface, const Vec3f& wo, float choice, Carries carries,
                        Scattered& out) {
  const Vec3f n = facing(surface, wo);
  const float ratio = surface.normal.dot(wo) > 0 ? surface.ior : 1 / surface.ior;
  const float cosine = std::fmin(n.dot(wo), 1.f);
  float inside = 0;
  const float reflected = fresnel(cosine, ratio, inside);
  out.weight = Vec3f::Ones();
  if (choice < reflected) {
    out.direction = (2 * cosine * n - wo).normalized();
    out.pdf = out.pdf_reverse = reflected;
    return true;
  }
  out.direction = ((cosine * n - wo) / ratio - inside * n).normalized();
  out.pdf = out.pdf_reverse = 1 - reflected;
  if (carries == Carries::radiance) out.weight /= ratio * ratio;
  return true;
}

}  // namespace

bool is_specular(const SurfacePoint& surface) {
  return surface.kind == SurfaceKind::mirror || surface.kind == SurfaceKind::dielectric ||
         surface.kind == SurfaceKind::none;
}

Vec3f evaluate(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  const Vec3f n = facing(surface, wo);
  if (surface.kind == SurfaceKind::diffuse)
    return n.dot(wi) > 0 ? Vec3f(surface.albedo / kPi) : Vec3f(0, 0, 0);
  if (surface.kind != SurfaceKind::glossy) return Vec3f::Zero();
  const Facets f = facets(n, wo, wi);
  if (!f.above) return Vec3f::Zero();
  const Gloss gloss = gloss_of(surface);
  const float seen = 1 / (1 + gloss.hidden(f.z_out) + gloss.hidden(f.z_in));
  return schlick(surface.albedo, f.along) * (gloss.distribution(f.z_half) * seen / (4 * f.z_out * f.z_in));
}

float density(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi) {
  const Vec3f n = facing(surface, wo);
  if (surface.kind == SurfaceKind::diffuse) return std::fmax(n.dot(wi), 0.f) / kPi;
  if (surface.kind != SurfaceKind::glossy) return 0;
  const Facets f = facets(n, wo, wi);
  if (!f.above) return 0;
  const Gloss gloss = gloss_of(surface);
  return gloss.distribution(f.z_half) / ((1 + gloss.hidden(f.z_out)) * 4 * f.z_out);
}

bool scatter(const SurfacePoint& surface, const Vec3f& wo, float choice, Sample2 at, Carries carries,
             Scattered& out) {
  const Vec3f n = facing(surface, wo);
  out.specular = is_specular(surface);
  switch (surface.kind) {
    case SurfaceKind::diffuse:
      out.direction = cosine_direction(n, at);
      out.weight = surface.albedo;
      break;
    case SurfaceKind::glossy: {
      const float alpha = std::sqrt(gloss_of(surface).alpha2);
      // The frame of around(n, ...), undone.
      const Vec3f x = around(n, 1, 0, 0), y = around(n, 0, 1, 0);
      const Vec3f local(x.dot(wo), y.dot(wo), n.dot(wo));
      const Vec3f h = visible_normal(alpha, local, at), half = around(n, h.x(), h.y(), h.z());
      out.direction = (2 * wo.dot(half) * half - wo).normalized();
      out.pdf = density(surface, wo, out.direction);
      if (!(out.pdf > 0)) return false;
      out.weight = evaluate(surface, wo, out.direction) * (n.dot(out.direction) / out.pdf);
      break;
    }
    case SurfaceKind::mirror:
      out.direction = (2 * n.dot(wo) * n - wo).normalized();
      out.weight = surface.albedo;
      out.pdf = out.pdf_reverse = 1;
      return true;
    case SurfaceKind::dielectric:
      return scatter_dielectric(surface, wo, choice, carries, out);
    case SurfaceKind::none:
      out.direction = -wo;
      out.weight = Vec3f::Ones();
      out.pdf = out.pdf_reverse = 1;
      return true;
    case SurfaceKind::emission:
      return false;
  }
  out.pdf = density(surface, wo, out.direction);
  out.pdf_reverse = density(surface, out.direction, wo);
  return out.pdf > 0;
}

}  // namespace firn
