#include "proto/recipe/written.h"

#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using namespace std::string_literals;

using testing::AllOf;
using testing::HasSubstr;

TEST(WrittenModel, IsTheSameInWhateverOrderItIsSaid) {
  WrittenModel there;
  there.set("length", 0.2);
  there.set("k", 1e7);
  there.set("links", 2);
  there.set_preset("printed");
  WrittenModel back;
  back.set_preset("printed");
  back.set("links", 2);
  back.set("k", 1e7);
  back.set("length", 0.2);
  EXPECT_EQ(there.model(), back.model());
  EXPECT_EQ(there.model().lengths_m, (std::vector{0.2, 0.2}));
  EXPECT_EQ(there.model().k_N_m, 1e7);
  EXPECT_EQ(there.model().eta2, solver::preset("printed").eta2);
  EXPECT_EQ(WrittenModel().model(), solver::preset("standard"));
}

TEST(WrittenModel, NamesKeyAndValueThatNoModelHas) {
  const struct {
    std::function<void(WrittenModel&)> write;
    const char* key;
    const char* says;
  } wrong[] = {
      {[](auto& model) { model.set("tip_mas", 1); }, "tip_mas", "did you mean `tip_mass`"},
      {[](auto& model) { model.set("rho", -1); }, "rho", "rho = -1"},
      {[](auto& model) { model.set_preset("papre"); }, "preset", "papre"},
      {[](auto& model) {
         model.set_lengths({0.4, -0.3});
       },
       "lengths", "lengths = -0.3"},
      {[](auto& model) { model.set_lengths({}); }, "lengths", "lengths = []"},
      {[](auto& model) { model.set_lengths(std::vector(65, 0.1)); }, "lengths", "from 1 to 64"},
      {[](auto& model) {
         model.set("links", 1);
         model.set_lengths({0.4});
       },
       "lengths", "lengths stands beside"},
      {[](auto& model) {
         model.set_lengths({0.4});
         model.set("length", 1);
       },
       "lengths", "lengths stands beside"},
  };
  for (const auto& [write, key, says] : wrong) {
    WrittenModel model;
    try {
      write(model);
      (void)model.model();
      ADD_FAILURE() << says;
    } catch (const solver::InputError& error) {
      EXPECT_EQ(error.fields().key, key);
      EXPECT_THAT(error.what(), HasSubstr(says));
    }
  }
}

TEST(StudyName, MayBeAnyTextThatPeopleCanReadAndShellsTake) {
  for (const auto& name : {"paper"s, "μ and e, 2nd"s, "a-b"s, "参数"s, std::string(100, 'x')}) {
    EXPECT_EQ(objection_to_study_name(name), "") << name;
  }
  for (const auto& name : {""s, std::string(101, 'x'), "-x"s}) {
    EXPECT_NE(objection_to_study_name(name), "") << name;
  }
}

TEST(StudyName, IsRefusedAndShownEscapedWithCharactersThatAreNotVisible) {
  for (const auto& name : {"a\x1b[2J"s, "a\0b"s, "two\nlines"s, "\x7f"s, "\u009b2J"s, "a\u202eb"s,
                           "\u200e"s, "a\xff"s, "a\u200bb"s, "\ufeff"s, "a\u00adb"s}) {
    const auto objection = objection_to_study_name(name);
    EXPECT_THAT(objection, AllOf(HasSubstr("control characters"), HasSubstr("\\"),
                                 testing::Not(HasSubstr(name))));
  }
}

TEST(StudyPriority, IsWithinLimitsThatTheObjectionNames) {
  for (const std::int64_t priority : {-1000, 0, 1000}) {
    EXPECT_EQ(objection_to_priority(priority), "");
  }
  EXPECT_EQ(objection_to_priority(1001), "priority = 1001 is not allowed: -1000 to 1000 is");
  EXPECT_NE(objection_to_priority(-1001), "");
}

}  // namespace
}  // namespace oblique::protocol
