#include "server/service/counts/open_studies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::server {
namespace {

using testing::HasSubstr;

constexpr StudyBounds kBounds{.studies = 3, .points = 100};

TEST(OpenStudies, ABoundIsReachedExactlyAndIsNamed) {
  OpenStudies open(kBounds);
  EXPECT_EQ(open.objection_to(1, 100), "");
  EXPECT_THAT(open.objection_to(1, 101), HasSubstr("--limits-open-points"));
  EXPECT_THAT(open.objection_to(1, UINT64_MAX), HasSubstr("100 points"));
  open.set(1, 60);
  open.set(2, 20);
  EXPECT_EQ(open.objection_to(3, 20), "");
  EXPECT_NE(open.objection_to(3, 21), "");
  open.set(3, 0);
  EXPECT_THAT(open.objection_to(4, 0), HasSubstr("3 studies are open"));
}

TEST(OpenStudies, SettledPointsAndClosedStudiesMakeRoom) {
  OpenStudies open(kBounds);
  open.set(1, 100);
  EXPECT_NE(open.objection_to(2, 1), "");
  open.set_points(1, 10);
  EXPECT_EQ(open.objection_to(2, 90), "");
  open.close(1);
  open.close(1);
  EXPECT_EQ(open.objection_to(2, 100), "");
  open.set_points(1, 30);
  EXPECT_EQ(open.objection_to(2, 100), "") << "what is closed has no open points";
}

TEST(OpenStudies, AStudyThatIsOpenAlreadyIsCountedOnce) {
  OpenStudies open({.studies = 1, .points = 100});
  open.set(1, 60);
  EXPECT_EQ(open.objection_to(1, 100), "");
  EXPECT_NE(open.objection_to(1, 101), "");
}

}  // namespace
}  // namespace oblique::server
