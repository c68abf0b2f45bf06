#include "proto/recipe/written/study_name.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using namespace std::string_literals;

TEST(StudyName, MayBeAnyTextThatPeopleCanReadAndShellsTake) {
  for (const auto& name : {"paper"s, "μ and e, 2nd"s, "a-b"s, "参数"s, std::string(100, 'x')}) {
    EXPECT_EQ(objection_to_study_name(name), "") << name;
  }
}

TEST(StudyName, IsRefusedWhenItIsEmptyTooLongOrLikeAFlag) {
  for (const auto& name : {""s, std::string(101, 'x'), "-x"s}) {
    EXPECT_NE(objection_to_study_name(name), "") << name;
  }
}

TEST(StudyName, IsRefusedAndShownEscapedWhenItWouldSteerATerminal) {
  for (const auto& name : {"a\x1b[2J"s, "a\0b"s, "two\nlines"s, "tab\t"s, "\x7f"s, "\u009b2J"s,
                           "a\u202eb"s, "a\u2066b"s, "\u200e"s, "a\xff"s, "\x9b"s}) {
    const auto objection = objection_to_study_name(name);
    EXPECT_NE(objection.find("control characters"), std::string::npos) << objection;
    EXPECT_NE(objection.find("\\"), std::string::npos) << objection;
    EXPECT_EQ(objection.find(name), std::string::npos);
  }
}

TEST(StudyName, IsRefusedAndShownEscapedWhenItHasACharacterWithoutWidth) {
  for (const auto& name :
       {"a\u200bb"s, "a\u200c"s, "a\u200db"s, "\u2060a"s, "\ufeff"s, "a\u00adb"s}) {
    const auto objection = objection_to_study_name(name);
    EXPECT_NE(objection.find("zero-width"), std::string::npos) << objection;
    EXPECT_EQ(objection.find(name), std::string::npos) << objection;
  }
}

}  // namespace
}  // namespace oblique::protocol
