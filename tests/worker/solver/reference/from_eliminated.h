#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "worker/solver/reference/chain_kernel.h"
#include "worker/solver/reference/constrained_chain.h"

namespace oblique::solver {

/// Converts a state of the eliminated chain of the same model to the coordinates of `chain`.
inline ChainState from_eliminated(const ConstrainedChain& chain, const ChainState& eliminated) {
  ChainState state = chain.at_rest();
  state.t_s = eliminated.t_s;
  // Each link has one column for its multiplier and two columns per node.
  const auto links = static_cast<Eigen::Index>(chain.links());
  const Eigen::Index elements_per_link = (chain.rows() / links - 3) / 2;
  std::size_t left = 0;  // row of the element's inner node in the eliminated chain
  for (Eigen::Index link = 0; link < links; ++link) {
    for (Eigen::Index e = 0; e < elements_per_link; ++e) {
      const bool ends_at_joint = e + 1 == elements_per_link && link + 1 < links;
      const ElementRows rows = rows_of_element(left, ends_at_joint);
      const std::array<std::size_t, 4> from{rows.p_i, rows.s_i, rows.p_j, rows.s_j};
      const auto first = chain.multiplier_row(static_cast<std::size_t>(link)) + 1 + 2 * e;
      state.q.middleCols<4>(first) = eliminated.q(Eigen::all, from);
      state.v.middleCols<4>(first) = eliminated.v(Eigen::all, from);
      left = rows.p_j;
    }
  }
  return state;
}

}  // namespace oblique::solver
