// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include "kernels/reference/trace.h"

namespace firn::kernels::reference {
namespace {

constexpr int kParts = 64;
constexpr int kMostSpans = 1024;

struct Span {
  double begin, end;  // m, along the ray
};

struct Line {
  const double *o, *d;
  double at(int a, double t) const { return o[a] + t * d[a]; }
};

Span chord(const Line& ray, const double center[3], double radius) {
  const Meeting meeting = meet(ray.o, ray.d, center, radius);
  if (!meeting.exists) return {1, 0};
  return {meeting.t, meeting.t + 2 * std::sqrt(meeting.depth2)};
}

// A cell of an occupied brick, or none (slot < 0).
struct Cell {
  int at[3];
  std::int64_t slot = -1;

  Cell(const TraceGrid& grid, const Line& ray, double t) {
    for (int a = 0; a < 3; ++a) {
      const double p = std::floor(ray.at(a, t) / grid.cell);
      if (!(p >= 0 && p < grid.cells[a])) return;
      at[a] = static_cast<int>(p);
    }
    slot =
        grid.slot[(static_cast<std::int64_t>(at[0] >> 2) * grid.bricks[1] + (at[1] >> 2)) * grid.bricks[2] +
                  (at[2] >> 2)];
  }
  int number() const { return (at[0] & 3) << 4 | (at[1] & 3) << 2 | (at[2] & 3); }

  double of(const TraceGrid& grid, const float* corners, const Line& ray, double t) const {
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
      double weight = 1;
      int place = 0;
      for (int a = 0; a < 3; ++a) {
        const double part = ray.at(a, t) / grid.cell - at[a];
        const int up = k >> (2 - a) & 1;
        weight *= up ? part : 1 - part;
        place = place * kCornerSide + (at[a] & 3) + up;
      }
      sum += weight * corners[slot * kBrickCorners + place];
    }
    return sum;
  }
};

// Within one cell, and within or without one set of balls.
double depth_of_piece(const TraceGrid& grid, const MediumField& field, const Line& ray, const Cell& cell,
                      bool in_ball, double begin, double end) {
  const int c = cell.number();
  const std::uint32_t kind = field.cell_kind[cell.slot * 8 + (c >> 3)] >> (4 * (c & 7)) & 3;
  const bool deep = (field.cell[cell.slot * kCellsPerBrick + c] & kClass) != 0;
  const auto sigma = [&](double t) {
    const double density = cell.of(grid, field.density, ray, t);
    const double scale = deep ? field.reduced : field.extinction;
    if (field.ball_density < 0) return in_ball ? density * scale : 0;
    const bool snow =
        kind == kInside || (kind == kCrossed && cell.of(grid, field.fill, ray, t) >= field.level);
    return scale * std::fmax(snow ? density : 0., in_ball ? field.ball_density : 0.);
  };
  if (field.ball_density < 0 || (!in_ball && kind != kCrossed))
    return (end - begin) / 6 * (sigma(begin) + 4 * sigma((begin + end) / 2) + sigma(end));
  double sum = 0;
  for (int k = 0; k < kParts; ++k) sum += sigma(begin + (k + 0.5) / kParts * (end - begin));
  return sum * (end - begin) / kParts;
}

// What of a ray lies in balls: disjoint spans, in no order.
struct Spans {
  Span of[kMostSpans];
  int count = 0;
  bool full = false;

  void add(Span s) {
    for (int k = 0; k < count;) {
      if (of[k].end < s.begin || s.end < of[k].begin) {
        ++k;
        continue;
      }
      s = {std::fmin(s.begin, of[k].begin), std::fmax(s.end, of[k].end)};
      of[k] = of[--count];
    }
    full = full || count == kMostSpans;
    if (!full) of[count++] = s;
  }
  bool contain(double t) const {
    for (int k = 0; k < count; ++k) {
      if (of[k].begin <= t && t <= of[k].end) return true;
    }
    return false;
  }
  // Where the next of them begins or ends.
  double next(double t) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < count; ++k) {
      if (of[k].begin > t) nearest = std::fmin(nearest, of[k].begin);
      if (of[k].end > t) nearest = std::fmin(nearest, of[k].end);
    }
    return nearest;
  }
};

void add_balls(const TraceGrid& grid, std::size_t count, const Line& ray, Spans& spans) {
  for (std::size_t p = 0; p < count; ++p) {
    const double radius = grid.radius == nullptr ? grid.max_radius : grid.radius[p];
    if (!(radius > 0)) continue;
    const double center[3] = {grid.x[p], grid.y[p], grid.z[p]};
    const Span span = chord(ray, center, radius);
    if (span.begin < span.end) spans.add(span);
  }
}

// The faces of the cells across one axis, in the order in which the ray passes them.
struct Faces {
  const TraceGrid& grid;
  const Line& ray;
  int axis, face;

  Faces(const TraceGrid& its_grid, const Line& its_ray, int a)
      : grid(its_grid), ray(its_ray), axis(a), face(its_ray.d[a] > 0 ? 0 : its_grid.cells[a]) {}
  double next(double t) {
    if (ray.d[axis] == 0) return std::numeric_limits<double>::infinity();
    for (; face >= 0 && face <= grid.cells[axis]; face += ray.d[axis] > 0 ? 1 : -1) {
      const double at = (face * static_cast<double>(grid.cell) - ray.o[axis]) / ray.d[axis];
      if (at > t) return at;
    }
    return std::numeric_limits<double>::infinity();
  }
};

double depth_of_strays(const TraceGrid& grid, const MediumField& field, const Line& ray, Span within) {
  double sum = 0;
  for (std::uint64_t k = 0; k < grid.stray_bundles * kRayLanes; ++k) {
    const BallBundle& balls = grid.strays[k / kRayLanes];
    const std::uint64_t lane = k % kRayLanes;
    if (!(balls.r2[lane] > 0)) continue;
    const double center[3] = {balls.x[lane], balls.y[lane], balls.z[lane]};
    const Span span = chord(ray, center, std::sqrt(static_cast<double>(balls.r2[lane])));
    const double length = std::fmin(span.end, within.end) - std::fmax(span.begin, within.begin);
    sum += std::fmax(length, 0.) * field.stray_extinction[k];
  }
  return sum;
}

}  // namespace

double optical_depth(const TraceGrid& grid, const MediumField& field, std::size_t count, const double o[3],
                     const double d[3], double from, double to) {
  const Line ray{o, d};
  Spans balls;
  add_balls(grid, count, ray, balls);
  if (balls.full) return std::numeric_limits<double>::quiet_NaN();
  double sum = depth_of_strays(grid, field, ray, {from, to});
  Faces faces[3] = {{grid, ray, 0}, {grid, ray, 1}, {grid, ray, 2}};
  for (double begin = from, end; begin < to; begin = end) {
    const double face =
        std::fmin(faces[0].next(begin), std::fmin(faces[1].next(begin), faces[2].next(begin)));
    if (std::isinf(face)) break;  // beyond the cells
    end = std::fmin(to, std::fmin(face, balls.next(begin)));
    const double middle = (begin + end) / 2;
    const Cell cell(grid, ray, middle);
    if (cell.slot >= 0) sum += depth_of_piece(grid, field, ray, cell, balls.contain(middle), begin, end);
  }
  return sum;
}

}  // namespace firn::kernels::reference
