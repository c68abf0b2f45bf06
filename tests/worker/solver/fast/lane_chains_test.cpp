#include "worker/solver/fast/lane_chains.h"

#include <gtest/gtest.h>

#include <cstddef>

#include "worker/solver/reference/chain.h"

namespace oblique::solver {
namespace {

constexpr std::size_t kLanes = 4;
struct FourNumbers {
  double lane[kLanes];
};

Chain chain_with(double E_Pa, int elements_per_link = 2) {
  ModelParameters model = preset("paper");
  model.E_Pa = E_Pa;
  model.elements_per_link = elements_per_link;
  return Chain(model);
}

TEST(LaneChains, HoldTheConstantsOfEachLane) {
  const Chain soft = chain_with(6e10);
  const Chain hard = chain_with(8e10);
  LaneChains chains(soft.tables(), kLanes);
  chains.set(2, hard.tables());
  const auto packs = chains.tables().of<FourNumbers>();
  const auto of_soft = soft.tables();
  const auto of_hard = hard.tables();
  EXPECT_EQ(packs.rows, of_soft.rows);
  EXPECT_EQ(packs.tip_row, of_soft.tip_row);
  for (const std::size_t lane : {std::size_t{0}, std::size_t{2}, std::size_t{3}}) {
    const auto& expected = lane == 2 ? of_hard : of_soft;
    EXPECT_EQ(packs.link[2].k22_tt.lane[lane], expected.link[2].k22_tt);
    EXPECT_EQ(packs.mass_factor[1].left[0].lane[lane], expected.mass_factor[1].left[0]);
    EXPECT_EQ(packs.mass_factor[packs.rows - 1].inverse_pivot.lane[lane],
              expected.mass_factor[packs.rows - 1].inverse_pivot);
    EXPECT_EQ(packs.weight_N[3].lane[lane], expected.weight_N[3]);
    EXPECT_EQ(packs.momentum_kg[packs.tip_row].lane[lane], expected.momentum_kg[packs.tip_row]);
    EXPECT_EQ(packs.balance[2].weight_beyond_N.lane[lane], expected.balance[2].weight_beyond_N);
  }
}

TEST(LaneChains, ChainsAreEqualWhenTheirConstantsAre) {
  const Chain chain = chain_with(7e10);
  EXPECT_TRUE(are_equal(chain.tables(), chain.tables()));
  EXPECT_TRUE(are_equal(chain.tables(), chain_with(7e10).tables()));
  EXPECT_FALSE(are_equal(chain.tables(), chain_with(7.1e10).tables()));
  EXPECT_TRUE(have_one_shape(chain.tables(), chain_with(7.1e10).tables()));
  EXPECT_FALSE(have_one_shape(chain.tables(), chain_with(7e10, 3).tables()));
  EXPECT_FALSE(are_equal(chain.tables(), chain_with(7e10, 3).tables()));
}

}  // namespace
}  // namespace oblique::solver
