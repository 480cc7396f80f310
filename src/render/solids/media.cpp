// SPDX-License-Identifier: MIT
#include "src/render/solids/media.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "firn/error.h"
#include "src/core/portable_math.h"
#include "src/core/rng.h"
#include "src/render/solids/shape_rays.h"

namespace firn {
namespace {

constexpr std::size_t kKeptSpans = 8;  // media beyond are met twice

Span inside_shape(const Medium& medium, const Pose& pose, const Vec3f& o, const Vec3f& d) {
  const Shape& shape = medium.shape;
  const Vec3 moved = o.cast<double>() - pose.translation;
  if (const auto* ball = std::get_if<Ball>(&shape.form)) return inside(*ball, moved, d.cast<double>());
  const Vec3 from = pose.rotation.transpose() * moved, along = pose.rotation.transpose() * d.cast<double>();
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

Vec3f extinction(const Medium& medium) { return medium.sigma_s + medium.sigma_a; }

Vec3f fading(const Vec3& depth) {
  Eigen::Array4f out;
  out << -depth.cast<float>().array(), 0;
  return portable_expf(out).head<3>().matrix();
}

// Adds the optical depth of what lies in `span` before `reach`.
void cross(const Span& span, double reach, const Medium& medium, Vec3& depth) {
  const double length = std::min(span.out, reach) - std::max(span.in, 0.0);
  if (span.empty() || !(length > 0)) return;
  const Vec3f sigma = extinction(medium);
  for (int c = 0; c < 3; ++c) depth[c] += sigma[c] > 0 ? length * sigma[c] : 0;  // the length may be infinite
}

// Throughput by density of a flight over this optical depth, its channel drawn evenly from the three; to a
// collision in `medium`, or unhindered.
Vec3f weight(Vec3 depth, const Medium* medium) {
  depth.array() -= depth.minCoeff();  // a common factor cancels
  const Vec3f left = fading(depth);
  if (!medium) return left / left.mean();
  return left.cwiseProduct(medium->sigma_s) / left.dot(extinction(*medium)) * 3;
}

}  // namespace

MediumSet::MediumSet(std::vector<Medium> media) : media_(std::move(media)), pose_(media_.size()) {
  for (std::size_t i = 0; i < media_.size(); ++i) {
    const Medium& medium = media_[i];
    const std::string where = "medium " + std::to_string(i);
    const auto& form = medium.shape.form;
    if (std::holds_alternative<Mesh>(form) || std::holds_alternative<HeightField>(form))
      throw Error(ErrorCode::usage, where, "its shape must be a ball, box, cylinder, capsule or plane");
    const Vec3f least = medium.sigma_s.cwiseMin(medium.sigma_a);
    if (!(least.minCoeff() >= 0) || !least.allFinite())
      throw Error(ErrorCode::usage, where, "sigma_s and sigma_a must not be negative");
    if (!(std::fabs(medium.g) < 1)) throw Error(ErrorCode::usage, where, "g must lie between -1 and 1");
  }
}

void MediumSet::place(const Vec3& origin) {
  for (std::size_t i = 0; i < media_.size(); ++i) {
    pose_[i] = media_[i].shape.pose;
    pose_[i].translation -= origin;
  }
}

MediumSet::Flight MediumSet::fly(const Vec3f& o, const Vec3f& d, float reach, std::uint64_t key) const {
  const auto channel = static_cast<Eigen::Index>(mix64(key) % 3);
  std::array<Span, kKeptSpans> spans;
  const auto span_of = [&](std::size_t i) { return inside_shape(media_[i], pose_[i], o, d); };
  Flight flight{-1, reach, Vec3f::Ones()};
  double nearest = reach;
  bool crosses = false;
  for (std::size_t i = 0; i < media_.size(); ++i) {
    const Span span = span_of(i);
    if (i < kKeptSpans) spans[i] = span;
    if (span.empty() || !(span.out > 0)) continue;
    crosses = true;
    const double sigma = extinction(media_[i])[channel];
    if (!(sigma > 0)) continue;
    const double free = -portable_logf(1 - uniform_float(hash_keys(key, i))) / sigma;
    const double t = std::max(span.in, 0.0) + free;
    if (!(t < span.out && t < nearest)) continue;
    nearest = t;
    flight.medium = static_cast<int>(i), flight.t = static_cast<float>(t);
  }
  if (!crosses) return flight;
  Vec3 depth = Vec3::Zero();
  for (std::size_t i = 0; i < media_.size(); ++i)
    cross(i < kKeptSpans ? spans[i] : span_of(i), flight.t, media_[i], depth);
  flight.weight =
      weight(depth, flight.medium < 0 ? nullptr : &media_[static_cast<std::size_t>(flight.medium)]);
  return flight;
}

Vec3f MediumSet::transmittance(const Vec3f& o, const Vec3f& d, float reach) const {
  Vec3 depth = Vec3::Zero();
  for (std::size_t i = 0; i < media_.size(); ++i)
    cross(inside_shape(media_[i], pose_[i], o, d), reach, media_[i], depth);
  return fading(depth);
}

}  // namespace firn
