#include "client/study/study_file.h"

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::client {
namespace {

using protocol::BlockKind;

/// Accepts every study, even if the tip does not reach H.
void no_reach_check(const protocol::PointTable&) {}

/// Makes random recipes with every kind of block.
class DrawnRecipe {
 public:
  explicit DrawnRecipe(unsigned seed) : random_(seed) {}

  protocol::Recipe recipe() {
    protocol::Recipe recipe;
    recipe.set_errors(chance(0.2));
    *recipe.mutable_model() = protocol::to_message(model());
    for (std::uint64_t i = 0; i <= below(3); ++i) {
      *recipe.add_blocks() = block();
    }
    return recipe;
  }

 private:
  std::uint64_t below(std::uint64_t n) {
    return std::uniform_int_distribution<std::uint64_t>(0, n - 1)(random_);
  }
  bool chance(double part) { return real(0.0, 1.0) < part; }
  double real(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  solver::ModelParameters model() {
    auto model = solver::preset(solver::preset_names()[below(4)]);
    if (chance(0.3)) {
      model.lengths_m.assign(3 + below(2), real(0.3, 0.5));
    } else if (chance(0.4)) {
      model.lengths_m = {real(0.3, 0.5), real(0.3, 0.5), 0.4};
    }
    if (chance(0.5)) {
      model.rho_kg_m3 = real(1000.0, 8000.0);
    }
    model.integrator = static_cast<solver::Integrator>(below(2));
    if (chance(0.3)) {
      model.dt_s = 1e-6;
      model.tolerance = 1e-6;
    }
    return model;
  }

  /// Draws an axis: in samples a list or a distribution, elsewhere a list, range or expression.
  protocol::Axis axis(const std::string& name, BlockKind kind, double from, double to) {
    const auto& key = protocol::axis_key(name);
    if (chance(0.3)) {
      return protocol::listed_axis(key, chance(0.5) ? several(from, to) : std::vector{from});
    }
    if (kind != BlockKind::kSample) {
      return chance(0.3) ? protocol::expressed_axis(key, std::to_string(from) + " + 0 * (e - e)")
                         : protocol::counted_axis(key, from, to, kCount,
                                                  static_cast<protocol::Spacing>(below(2)));
    }
    const auto drawn = static_cast<protocol::DistributionKind>(below(3));
    auto axis = protocol::uniform(name, from, to);
    axis.mutable_distribution()->set_kind(drawn);
    if (drawn == protocol::DISTRIBUTION_NORMAL) {
      axis.mutable_distribution()->set_mean(real(from, to));
      axis.mutable_distribution()->set_sd(0.5);
    }
    return axis;
  }

  std::vector<double> several(double from, double to) {
    std::vector<double> values;
    for (int i = 0; i < kCount; ++i) {
      values.push_back(real(from, to));
    }
    return values;
  }

  protocol::Block block() {
    const auto kind = static_cast<BlockKind>(below(3));
    std::vector<protocol::Axis> axes{axis("H", kind, 0.2, 0.8), axis("mu", kind, 0.1, 2.0)};
    // e is never an expression, because the expressions of other axes contain e.
    axes.push_back(kind == BlockKind::kSample
                       ? protocol::uniform("e", 0.5, 1.0)
                       : protocol::listed_axis(protocol::axis_key("e"), several(0.5, 1.0)));
    if (chance(0.4)) {
      axes.push_back(axis("k", kind, 1e7, 4e7));
    }
    if (chance(0.3)) {
      axes.push_back(axis("length2", kind, 0.35, 0.45));
    }
    if (chance(0.3)) {
      axes.push_back(protocol::listed_axis(protocol::axis_key("integrator"), {1.0, 0.0}));
      if (kind == BlockKind::kZip) {
        axes.pop_back();
      }
    }
    if (chance(0.3)) {
      axes.push_back(protocol::expressed_axis(protocol::axis_key("I"), "A^2 / (4 * pi)"));
    }
    auto block = protocol::block_of(std::move(axes));
    block.set_zip(kind == BlockKind::kZip);
    if (kind == BlockKind::kSample) {
      constexpr const char* kKinds[] = {"random", "lhs", "sobol"};
      *block.mutable_sample() =
          protocol::parse_sample(kKinds[below(3)], 1 + static_cast<std::int64_t>(below(1000)),
                                 static_cast<std::int64_t>(below(std::uint64_t{1} << 62)));
    }
    if (chance(0.4)) {
      block.set_where("mu > 0.5 * e and H <= 1 || A<1e300");
    }
    return block;
  }

  static constexpr int kCount = 4;
  std::mt19937 random_;
};

TEST(StudyToml, ReadsBackAsTheSameRecipe) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    const auto recipe = DrawnRecipe(seed).recipe();
    ASSERT_NO_THROW(protocol::PointTable{recipe}) << recipe.DebugString();
    const std::string text = study_toml("drawn", recipe);
    const auto again = parse_study(text, "again.toml", no_reach_check);
    EXPECT_EQ(again.name, "drawn");
    ASSERT_EQ(protocol::recipe_digest(again.recipe), protocol::recipe_digest(recipe)) << text;
  }
}

std::string written(const std::string& text, const std::string& name = "x") {
  return study_toml(name, parse_study(text, "x.toml", no_reach_check).recipe);
}

TEST(StudyToml, LooksLikeAHandWrittenFile) {
  EXPECT_EQ(written("[[block]]\nH=1\nmu={from=0.1,to=2,step=0.1}\ne=[0.5,1]\n", "friction"),
            "name = \"friction\"\n\n[model]\npreset = \"standard\"\n\n[[block]]\nH = 1\nmu = { "
            "from = 0.1, to = 2, count = 20 }\n"
            "e = [0.5, 1]\n");
  EXPECT_EQ(written("errors=true\n[model]\npreset='printed'\nk=1e7\n[[block]]\nsample={kind='lhs',"
                    "count=9}\nH={from=0.5,to=1}\nmu=1\ne=1\nI='A^2'\nwhere='mu>e'\n"),
            "name = \"x\"\nerrors = true\n\n[model]\npreset = \"printed\"\nk = 1e+07\n\n[[block]]\n"
            "sample = { kind = \"lhs\", count = 9, seed = 1 }\nI = \"A^2\"\n"
            "H = { distribution = \"uniform\", from = 0.5, to = 1 }\nmu = 1\ne = 1\n"
            "where = \"mu>e\"\n");
}

TEST(StudyToml, EscapesNames) {
  const std::string name = "\"quoted\\ \xc3\xa9";
  const auto text = written("[[block]]\nH=1\nmu=[0.5,1]\ne=1\n", name);
  EXPECT_EQ(parse_study(text, "x.toml", no_reach_check).name, name);
}

}  // namespace
}  // namespace oblique::client
