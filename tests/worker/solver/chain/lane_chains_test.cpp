#include "worker/solver/chain/lane_chains.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "worker/solver/chain/chain.h"

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

TEST(LaneChains, LieOnTheBoundsOfTheWidestVectors) {
  const Chain chain = chain_with(7e10);
  for (const std::size_t lanes : {std::size_t{4}, std::size_t{8}}) {
    const LaneChains chains(chain.tables(), lanes);
    const LaneTables tables = chains.tables();
    for (const double* array :
         {tables.link, tables.mass_factor, tables.weight_N, tables.momentum_kg, tables.balance}) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array) % (lanes * sizeof(double)), 0U);
    }
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

TEST(LaneChains, SlopesBetweenElementsHaveNeitherWeightNorMomentum) {
  ModelParameters model = preset("paper");
  model.lengths_m = {0.1, 0.3, 0.7};
  model.elements_per_link = 3;
  const Chain chain(model);
  const auto tables = chain.tables();
  for (std::size_t link = 0; link < tables.links; ++link) {
    for (const std::size_t slope : {std::size_t{3}, std::size_t{5}}) {
      const std::size_t row = link * (2 * tables.elements_per_link + 1) + slope;
      EXPECT_EQ(tables.weight_N[row], 0.0);
      EXPECT_EQ(tables.momentum_kg[row], 0.0);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
