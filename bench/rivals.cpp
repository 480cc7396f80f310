// SPDX-License-Identifier: MIT
#include "bench/rivals.h"

#include "bench/embree_bricks.h"
#include "bench/embree_points.h"

namespace firn::bench {

std::vector<std::unique_ptr<Tracer>> make_rivals(const Balls& balls, const std::string& isa, int threads) {
  std::vector<std::unique_ptr<Tracer>> rivals;
  rivals.push_back(std::make_unique<EmbreePoints>(balls, threads));
  for (const BrickRays rays : {BrickRays::singly, BrickRays::packets}) {
    rivals.push_back(std::make_unique<EmbreeBricks>(balls, isa, threads, rays));
  }
  return rivals;
}

std::string rivals_version() { return EmbreeScene::version(); }

}  // namespace firn::bench
