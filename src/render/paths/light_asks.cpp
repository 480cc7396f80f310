// SPDX-License-Identifier: MIT
#include "src/render/paths/light_asks.h"

#include <limits>

namespace firn {

void LightAsks::clear() {
  draws_.clear();
  whose_.clear();
  rays_.clear();
}

void LightAsks::push(const PathRandom& random, std::uint32_t number, const Vec3f& p, std::uint32_t whose) {
  draws_.push(random, number);
  whose_.push_back(whose);
  rays_.push(p, Vec3f::UnitZ(), 0);
}

void LightAsks::send(const World& world, const kernels::ShadeKernels& with, std::uint32_t link, float share) {
  const std::size_t count = size();
  for (auto* column : {&choice_, &u_, &v_}) column->resize(count);
  marks_.key.resize(count);
  marks_.share.assign(count, share);
  with.pairs(draws_.view(), 0, 0, count, choice_.data(), v_.data());
  with.pairs(draws_.view(), 1, 0, count, u_.data(), v_.data());
  with.keys(draws_.view(), link, 0, count, marks_.key.data());
  world.lights.aim(with, choice_.data(), u_.data(), v_.data(), rays_);
  for (std::size_t i = 0; i < count; ++i) rays_.t(i) *= kShort;
  Flights(world).pass(rays_, marks_, through_);
}

}  // namespace firn
