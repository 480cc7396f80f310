// SPDX-License-Identifier: MIT
#include "src/render/media.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "src/core/error.h"
#include "src/core/portable_math.h"
#include "src/core/rng.h"
#include "src/render/shape_rays.h"

namespace firn {
namespace {

Span inside_shape(const Medium& medium, const Pose& pose, const Vec3f& o, const Vec3f& d) {
  const Shape& shape = medium.shape;
  const Vec3 from = pose.rotation.transpose() * (o.cast<double>() - pose.translation);
  const Vec3 along = pose.rotation.transpose() * d.cast<double>();
  if (const auto* ball = std::get_if<Ball>(&shape.form)) return inside(*ball, from, along);
  if (const auto* box = std::get_if<Box>(&shape.form)) return inside(*box, from, along);
  if (const auto* cylinder = std::get_if<Cylinder>(&shape.form)) return inside(*cylinder, from, along);
  if (const auto* capsule = std::get_if<Capsule>(&shape.form)) return inside(*capsule, from, along);
  const HalfSpace plane;
  Span span = inside(plane, from, along);
  if (std::isfinite(medium.thickness) && !span.empty()) {  // without what lies deeper
    const Span below = inside(plane, from + Vec3(0, medium.thickness, 0), along);
    if (along.y() == 0) return below.empty() ? span : Span{};
    if (along.y() > 0) span.in = below.out;
    if (along.y() < 0) span.out = below.in;
  }
  return span;
}

Vec3 extinction(const Medium& medium) { return (medium.sigma_s + medium.sigma_a).cast<double>(); }

Vec3 fading(const Vec3& depth) {
  return {portable_exp(-depth[0]), portable_exp(-depth[1]), portable_exp(-depth[2])};
}

}  // namespace

MediumSet::MediumSet(std::vector<Medium> media) : media_(std::move(media)), pose_(media_.size()) {
  for (std::size_t i = 0; i < media_.size(); ++i) {
    const Medium& medium = media_[i];
    const std::string where = "medium " + std::to_string(i);
    const auto& form = medium.shape.form;
    if (std::holds_alternative<Mesh>(form) || std::holds_alternative<HeightField>(form))
      throw Error(ExitCode::usage, where, "its shape must be a ball, box, cylinder, capsule or plane");
    const Vec3f least = medium.sigma_s.cwiseMin(medium.sigma_a);
    if (!(least.minCoeff() >= 0) || !least.allFinite())
      throw Error(ExitCode::usage, where, "sigma_s and sigma_a must not be negative");
    if (!(std::fabs(medium.g) < 1)) throw Error(ExitCode::usage, where, "g must lie between -1 and 1");
  }
}

void MediumSet::place(const Vec3& origin) {
  for (std::size_t i = 0; i < media_.size(); ++i) {
    pose_[i] = media_[i].shape.pose;
    pose_[i].translation -= origin;
  }
}

MediumSet::Collision MediumSet::collide(const Vec3f& o, const Vec3f& d, float reach,
                                        std::uint64_t key) const {
  const auto channel = static_cast<Eigen::Index>(mix64(key) % 3);
  Collision found;
  double nearest = reach;
  for (std::size_t i = 0; i < media_.size(); ++i) {
    const Span span = inside_shape(media_[i], pose_[i], o, d);
    const double sigma = extinction(media_[i])[channel];
    if (span.empty() || !(sigma > 0)) continue;
    const double free = -portable_log(1 - uniform_double(hash_keys(key, i))) / sigma;
    const double t = std::max(span.in, 0.0) + free;
    if (!(t < span.out && t < nearest)) continue;
    nearest = t;
    found = {static_cast<int>(i), static_cast<float>(t)};
  }
  return found;
}

Vec3 MediumSet::depth(const Vec3f& o, const Vec3f& d, double reach) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < media_.size(); ++i) {
    const Span span = inside_shape(media_[i], pose_[i], o, d);
    const double length = std::min(span.out, reach) - std::max(span.in, 0.0);
    if (span.empty() || !(length > 0)) continue;
    const Vec3 sigma = extinction(media_[i]);
    for (int c = 0; c < 3; ++c) sum[c] += sigma[c] > 0 ? length * sigma[c] : 0;  // the length may be infinite
  }
  return sum;
}

Vec3f MediumSet::weight(const Vec3f& o, const Vec3f& d, float t, int medium) const {
  Vec3 passed = depth(o, d, t);
  passed.array() -= passed.minCoeff();  // a common factor cancels
  const Vec3 left = fading(passed);
  if (medium < 0) return (left / left.mean()).cast<float>();
  const Vec3 density = left.cwiseProduct(extinction(media_[medium]));
  return (left.cwiseProduct(media_[medium].sigma_s.cast<double>()) / density.mean()).cast<float>();
}

Vec3f MediumSet::transmittance(const Vec3f& o, const Vec3f& d, float reach) const {
  return fading(depth(o, d, reach)).cast<float>();
}

}  // namespace firn
