#include "worker/solver/model/fall_model.h"

#include <set>

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

TEST(FallModel, ModelsHaveOneHashExactlyWhenTheyShareAFall) {
  std::set<std::uint64_t> hashes{fall_hash(ModelParameters())};
  std::size_t falls = 1;
  for (const auto& key : model_keys()) {
    ModelParameters model;
    key.set(model, key.name == "tolerance" ? 1e-7 : key.get(model) + 1.0);
    falls += fall_model(model) == fall_model(ModelParameters()) ? 0U : 1U;
    EXPECT_EQ(hashes.insert(fall_hash(model)).second,
              !(fall_model(model) == fall_model(ModelParameters())))
        << key.name;
  }
  EXPECT_EQ(hashes.size(), falls);
  ModelParameters contact;
  contact.k_N_m = 1e8;
  contact.eta2 = 1.0;
  contact.dt_s = 1e-7;
  EXPECT_EQ(fall_hash(contact), fall_hash(ModelParameters()));
}

}  // namespace
}  // namespace oblique::solver
