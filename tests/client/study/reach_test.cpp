#include "client/study/reach.h"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "tests/client/study/study_text.h"

namespace oblique::client {
namespace {

TEST(Reach, AFallIsSolvedOnceForAllBlocksThatShareIt) {
  std::string text;
  for (int i = 0; i < 50; ++i) {
    text += "[[block]]\nH = 1.1\nmu = 0." + std::to_string(100 + i) + "\ne = 1\n";
    text += "k = [1e7, 2e7]\n";  // k, the contact's stiffness, does not change the fall
  }
  ReachChecker checker(fake_drop_m);
  EXPECT_EQ(parse_study(text, "x.toml", std::ref(checker)).recipe.blocks_size(), 50);
  EXPECT_GT(checker.falls_solved(), 0U);
  EXPECT_LE(checker.falls_solved(), 2U)
      << "one fall on a coarse mesh and one on the mesh of the model";
}

TEST(Reach, OnlyTheFirstFewFallsOfAStudyAreSolvedBeforehand) {
  std::string text = "[model]\nelements_per_link = 2\n";
  for (int i = 0; i < 30; ++i) {
    text += "[[block]]\nH = 1.1\nmu = 0.4\ne = 1\nrho = " + std::to_string(2700 + i) + "\n";
  }
  ReachChecker checker(fake_drop_m);
  parse_study(text, "x.toml", std::ref(checker));
  EXPECT_EQ(checker.falls_solved(), ReachChecker::kMaxFalls);
}

TEST(Reach, ASmallDropIsCheckedOnACoarseMesh) {
  ReachChecker checker(fake_drop_m);
  parse_study(block_with("H = 1.08"), "x.toml", std::ref(checker));
  EXPECT_EQ(checker.falls_solved(), 0U) << "no fall is needed for a drop that every finger reaches";
  parse_study(block_with("H = 1.1"), "x.toml", std::ref(checker));
  EXPECT_EQ(checker.falls_solved(), 1U);
  parse_study(block_with("H = 1.17"), "x.toml", std::ref(checker));
  EXPECT_EQ(checker.falls_solved(), 2U);
  EXPECT_THROW(parse_study(block_with("H = 1.18"), "x.toml", std::ref(checker)),
               solver::InputError);
  EXPECT_EQ(checker.falls_solved(), 2U) << "the fall of this model was solved again";
}

TEST(Reach, ADropThatDependsOnThePointIsNotChecked) {
  ReachChecker checker(fake_drop_m);
  for (const char* text :
       {"[[block]]\nH = [1, 1.19]\nmu = 0.4\ne = 1\nwhere = 'H < 1.1'\n",
        "[[block]]\nH = '0.9 + 0.1 * e'\nmu = 0.4\ne = [0.9, 1]\n",
        "[[block]]\nzip = true\nlength3 = [0.4, 0.5]\nH = [1, 1.25]\nmu = 1\ne = 1\n",
        "[[block]]\nsample = { kind = 'lhs', count = 9 }\n"
        "H = { distribution = 'normal', mean = 1, sd = 0.1, from = 0.5 }\nmu = 1\ne = 1\n"}) {
    EXPECT_NO_THROW(parse_study(text, "x.toml", std::ref(checker))) << text;
  }
  EXPECT_EQ(checker.falls_solved(), 0U);
}

TEST(Reach, TheEndOfADistributionMustBeReached) {
  ReachChecker checker(fake_drop_m);
  EXPECT_THROW(parse_study("[[block]]\nsample = { kind = 'lhs', count = 9 }\n"
                           "H = { from = 0.5, to = 1.19 }\nmu = 1\ne = 1\n",
                           "x.toml", std::ref(checker)),
               solver::InputError);
}

}  // namespace
}  // namespace oblique::client
