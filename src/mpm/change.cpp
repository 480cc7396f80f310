// SPDX-License-Identifier: MIT
// Particles taken out between two steps, and what has to be found again after any change.
#include <algorithm>

#include "src/mpm/state.h"

namespace firn {

void Solver::State::settle_anew() {
  rebuild_grid();
  summarise();
  changed = true;
}

// Its particles may lie beyond the reach of their tiles and of a sort.
void Solver::State::require_sound() const {
  if (steps > 0 && !changed) check_stability(last_step.dt);
}

std::size_t Solver::State::remove(const std::vector<std::uint32_t>& ids) {
  require_idle();
  require_sound();
  std::vector<std::uint32_t> gone = ids;
  std::sort(gone.begin(), gone.end());
  const auto is_gone = [&](std::uint32_t id) { return std::binary_search(gone.begin(), gone.end(), id); };
  const auto* const all = particles.view().id;
  if (std::none_of(all, all + particles.size(), is_gone)) return 0;
  if (summary.strayed) sort();
  const kernels::ParticleView p = particles.view();
  std::vector<std::uint32_t> order;
  std::vector<BlockKey> touched;  // blocks that lost some, ascending
  ParticleBlocks kept;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::size_t begin = order.size(), before = blocks.begin[b + 1] - blocks.begin[b];
    for (std::size_t i = blocks.begin[b]; i < blocks.begin[b + 1]; ++i) {
      if (!is_gone(p.id[i])) order.push_back(static_cast<std::uint32_t>(i));
    }
    if (order.size() - begin != before) touched.push_back(blocks.key[b]);
    if (order.size() == begin) continue;
    kept.coord.push_back(blocks.coord[b]);
    kept.key.push_back(blocks.key[b]);
    kept.begin.push_back(begin);
    kept.calm.push_back(blocks.calm[b]);
  }
  const std::size_t removed = particles.size() - order.size();
  kept.begin.push_back(order.size());
  for (std::size_t b = 0; b < kept.size(); ++b) {  // what lay on them may fall
    const auto around = keys_around(kept.coord[b]);
    if (std::any_of(around.begin(), around.end(),
                    [&](BlockKey k) { return find_block(touched, k).has_value(); }))
      kept.calm[b] = 0;
  }
  particles.permute(order);
  blocks = std::move(kept);
  settle_anew();
  return removed;
}

void Solver::add(PlacedSnow snow) { state_->add(std::move(snow)); }
std::size_t Solver::remove(const std::vector<std::uint32_t>& ids) { return state_->remove(ids); }

}  // namespace firn
