#include "client/output/unjudged_note.h"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/study_file.h"

namespace oblique::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

protocol::Recipe recipe_of(const std::string& blocks) {
  const auto any_reach = [](const protocol::PointTable&) {};
  return parse_study(blocks, "a.toml", any_reach).recipe;
}

/// A block of that many values of mu and ten thousand of e, with an axis that follows.
std::string block(int count, const std::string& further) {
  return "[[block]]\nH = 0.6\nmu = { from = 0.1, to = 2.0, count = " + std::to_string(count) +
         " }\ne = { from = 0.5, to = 1.0, count = 10000 }\n" + further + "\n";
}

TEST(UnjudgedNote, NamesTheBlockThatHasTooManyPointsToBeLookedAtAndSaysWhatBecomesOfThem) {
  const auto recipe = recipe_of(block(2, "") + block(20'000, "I = \"1e-8 * (1.9 - mu)\""));
  EXPECT_THAT(unjudged_blocks(recipe), ElementsAre(1U));
  std::ostringstream out;
  tell_unjudged(out, recipe);
  EXPECT_THAT(out.str(), HasSubstr("the values of block 2 "));
  EXPECT_THAT(out.str(), HasSubstr("were not judged"));
  EXPECT_THAT(out.str(), HasSubstr("fails, and its error says why"));
  const protocol::PointTable table(recipe);
  EXPECT_EQ(table.fault(20'000), "");  // the first of block 2, mu = 0.1
  EXPECT_THAT(table.fault(table.size() - 1), HasSubstr("I"));
}

TEST(UnjudgedNote, SaysNothingOfBlocksThatAreLookedAtOrHaveNothingThatFollows) {
  for (const std::string& further : {block(20'000, ""), block(2, "I = \"1e-8 * (3 - mu)\"")}) {
    const auto recipe = recipe_of(further);
    EXPECT_THAT(unjudged_blocks(recipe), IsEmpty());
    std::ostringstream out;
    tell_unjudged(out, recipe);
    EXPECT_EQ(out.str(), "");
  }
}

}  // namespace
}  // namespace oblique::client
