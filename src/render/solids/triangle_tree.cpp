// SPDX-License-Identifier: MIT
#include "src/render/solids/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace firn {
namespace {

using kernels::kRayLanes;

constexpr int kBins = 16;
constexpr int kHalvesFrom = 40;  // depth from which on triangles are halved, so that no tree grows too deep

struct Range {
  int begin = 0, end = 0;
  Bounds bounds;

  int size() const { return end - begin; }
  double area() const {
    const Vec3 s = bounds.size();
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
  }
};

class TreeBuilder {
 public:
  TreeBuilder(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles, TriangleTree& tree)
      : vertices_(vertices),
        triangles_(triangles),
        tree_(tree),
        order_(triangles.size()),
        box_(triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (const int corner : triangles[i]) box_[i].include(vertices[corner]);
    }
  }

  void build() {
    const Range all = range(0, static_cast<int>(order_.size()));
    const double most = std::max(all.bounds.min.cwiseAbs().maxCoeff(), all.bounds.max.cwiseAbs().maxCoeff());
    tree_.size = static_cast<float>(all.bounds.size().norm() + most);
    margin_ = Vec3::Constant(kernels::kMeshMargin * static_cast<double>(tree_.size));
    tree_.bounds = {all.bounds.min - margin_, all.bounds.max + margin_};
    add_node(all, 0);
  }

 private:
  Range range(int begin, int end) const {
    Range r{begin, end, {}};
    for (int i = begin; i < end; ++i) r.bounds.include(box_[order_[i]]);
    return r;
  }

  // In preorder; the result is its place.
  int add_node(const Range& all, int depth) {
    std::vector<Range> children{all};
    while (children.size() < kRayLanes) {
      int largest = -1;
      for (int k = 0; k < static_cast<int>(children.size()); ++k) {
        const bool whole = children[k].size() <= kRayLanes;
        if (!whole && (largest < 0 || children[k].area() > children[largest].area())) largest = k;
      }
      if (largest < 0) break;
      const Range cut = children[largest];
      const int middle = depth < kHalvesFrom ? cut_by_area(cut) : halve(cut);
      children[largest] = range(cut.begin, middle);
      children.push_back(range(middle, cut.end));
    }
    const int place = static_cast<int>(tree_.nodes.size());
    tree_.nodes.emplace_back();
    tree_.nodes[place].count = static_cast<int>(children.size());
    for (int k = 0; k < static_cast<int>(children.size()); ++k) {
      const Range& child = children[k];
      for (int a = 0; a < 3; ++a) {
        tree_.nodes[place].low[a][k] = static_cast<float>(child.bounds.min[a] - margin_[a]);
        tree_.nodes[place].high[a][k] = static_cast<float>(child.bounds.max[a] + margin_[a]);
      }
      const int its = child.size() <= kRayLanes ? ~add_bundle(child) : add_node(child, depth + 1);
      tree_.nodes[place].child[k] = its;
    }
    return place;
  }

  int add_bundle(const Range& range) {
    kernels::TriangleBundle bundle = {};
    std::fill(std::begin(bundle.index), std::end(bundle.index), -1);
    std::sort(order_.begin() + range.begin, order_.begin() + range.end);
    double longest = 1e-9 * static_cast<double>(tree_.size);  // below that doubles round, too
    for (int i = range.begin; i < range.end; ++i) {
      const Triangle& t = triangles_[order_[i]];
      const Vec3 a = vertices_[t[0]], u = vertices_[t[1]] - a, v = vertices_[t[2]] - a;
      const int k = i - range.begin;
      for (int axis = 0; axis < 3; ++axis) {
        bundle.a[axis][k] = static_cast<float>(a[axis]);
        bundle.u[axis][k] = static_cast<float>(u[axis]);
        bundle.v[axis][k] = static_cast<float>(v[axis]);
      }
      bundle.index[k] = order_[i];
      longest = std::max({longest, u.norm(), v.norm()});
    }
    bundle.longest = static_cast<float>(longest);
    tree_.bundles.push_back(bundle);
    return static_cast<int>(tree_.bundles.size()) - 1;
  }

  int halve(const Range& r) const { return r.begin + r.size() / 2; }

  struct Bin {
    Bounds bounds;
    int count = 0;
  };
  int bin_of(int triangle, int axis, double low, double scale) const {
    return std::min(static_cast<int>((box_[triangle].center()[axis] - low) * scale), kBins - 1);
  }

  // Sorts the range into two and says where the second begins.
  int cut_by_area(const Range& r) {
    Bounds centers;
    for (int i = r.begin; i < r.end; ++i) centers.include(box_[order_[i]].center());
    double least = std::numeric_limits<double>::infinity(), best_scale = 0;
    int best_axis = -1, best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double wide = centers.max[axis] - centers.min[axis], scale = kBins / wide;
      if (!(wide > 0) || !std::isfinite(scale)) continue;
      std::array<Bin, kBins> bins;
      for (int i = r.begin; i < r.end; ++i) {
        Bin& bin = bins[bin_of(order_[i], axis, centers.min[axis], scale)];
        bin.bounds.include(box_[order_[i]]);
        ++bin.count;
      }
      std::array<double, kBins> behind{};  // cost of the bins from each on
      Range sum;
      for (int b = kBins - 1; b > 0; --b) {
        sum.bounds.include(bins[b].bounds), sum.end += bins[b].count;
        behind[b] = sum.area() * sum.size();
      }
      sum = {};
      for (int b = 0; b + 1 < kBins; ++b) {
        sum.bounds.include(bins[b].bounds), sum.end += bins[b].count;
        const double cost = sum.area() * sum.size() + behind[b + 1];
        if (sum.size() == 0 || sum.size() == r.size() || !(cost < least)) continue;
        least = cost, best_axis = axis, best_bin = b, best_scale = scale;
      }
    }
    if (best_axis < 0) return halve(r);
    const auto middle =
        std::stable_partition(order_.begin() + r.begin, order_.begin() + r.end, [&](int triangle) {
          return bin_of(triangle, best_axis, centers.min[best_axis], best_scale) <= best_bin;
        });
    return static_cast<int>(middle - order_.begin());
  }

  const std::vector<Vec3>& vertices_;
  const std::vector<Triangle>& triangles_;
  TriangleTree& tree_;
  std::vector<int> order_;
  std::vector<Bounds> box_;  // per triangle
  Vec3 margin_;
};

}  // namespace

TriangleTree build_triangle_tree(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  TriangleTree tree;
  if (!triangles.empty()) TreeBuilder(vertices, triangles, tree).build();
  return tree;
}

}  // namespace firn
