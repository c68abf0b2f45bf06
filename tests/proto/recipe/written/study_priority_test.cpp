#include "proto/recipe/written/study_priority.h"

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

TEST(StudyPriority, IsWithinLimitsThatTheObjectionNames) {
  for (const std::int64_t priority : {-1000, 0, 1000}) {
    EXPECT_EQ(objection_to_priority(priority), "");
  }
  EXPECT_EQ(objection_to_priority(1001), "priority = 1001 is not allowed: -1000 to 1000 is");
  EXPECT_NE(objection_to_priority(-1001), "");
}

}  // namespace
}  // namespace oblique::protocol
