#include "server/service/counts/open_studies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr StudyBounds kBounds{
    .studies = 4, .points = 100, .studies_of_key = 2, .points_of_key = 50};

TEST(OpenStudies, ABoundIsReachedExactlyAndIsNamed) {
  OpenStudies open(kBounds);
  EXPECT_EQ(open.objection_to(1, "alice", 50), "");
  EXPECT_THAT(open.objection_to(1, "alice", 51),
              AllOf(HasSubstr("\"alice\""), HasSubstr("open-points-of-key"), HasSubstr("50")));
  open.set(1, "alice", 20);
  open.set(2, "alice", 20);
  EXPECT_THAT(open.objection_to(3, "alice", 1),
              AllOf(HasSubstr("2 studies"), HasSubstr("open-studies-of-key")));
  EXPECT_EQ(open.objection_to(3, "bob", 50), "") << "another key has its own";
}

TEST(OpenStudies, AllTogetherHaveBoundsThatHoldWithoutKeysToo) {
  OpenStudies open(kBounds);
  for (StudyId id = 1; id <= 3; ++id) {
    open.set(id, "", 10);
  }
  EXPECT_EQ(open.objection_to(4, "", 70), "");
  EXPECT_THAT(open.objection_to(4, "", 71), HasSubstr("open-points "));
  open.set(4, "bob", 1);
  EXPECT_THAT(open.objection_to(5, "alice", 1), HasSubstr("open-studies "));
  EXPECT_THAT(open.objection_to(5, "", UINT64_MAX), HasSubstr("open-studies "));
}

TEST(OpenStudies, WhatIsSettledOrClosedMakesRoom) {
  OpenStudies open(kBounds);
  open.set(1, "alice", 50);
  EXPECT_NE(open.objection_to(2, "alice", 1), "");
  open.set_points(1, 10);
  EXPECT_EQ(open.objection_to(2, "alice", 40), "");
  open.close(1);
  open.close(1);
  EXPECT_EQ(open.objection_to(2, "alice", 50), "");
  EXPECT_TRUE(open.shares().empty());
  open.set_points(1, 30);
  EXPECT_TRUE(open.shares().empty()) << "what is closed has no open points";
}

TEST(OpenStudies, OneThatIsOpenAlreadyTakesNoFurtherPlace) {
  OpenStudies open(kBounds);
  open.set(1, "alice", 10);
  open.set(2, "alice", 10);
  EXPECT_EQ(open.objection_to(2, "alice", 30), "");
  EXPECT_NE(open.objection_to(2, "alice", 31), "");
}

TEST(OpenStudies, AKeyThatWasRefusedIsRemembered) {
  OpenStudies open(kBounds);
  open.count_refusal("alice");
  open.set(1, "alice", 1);
  open.close(1);
  EXPECT_EQ(open.shares().at("alice").refused, 1U);
}

}  // namespace
}  // namespace oblique::server
