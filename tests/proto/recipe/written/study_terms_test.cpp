#include "proto/recipe/written/study_terms.h"

#include <limits>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

TEST(StudyTerms, HavePrioritiesAndWeightsWithinLimitsThatTheObjectionNames) {
  for (const std::int64_t priority : {-1000, 0, 1000}) {
    EXPECT_EQ(objection_to_priority(priority), "");
  }
  EXPECT_EQ(objection_to_priority(1001), "priority = 1001 is not allowed: -1000 to 1000 is");
  EXPECT_NE(objection_to_priority(-1001), "");
  for (const double weight : {0.001, 1.0, 1000.0}) {
    EXPECT_EQ(objection_to_weight(weight), "");
  }
  EXPECT_EQ(objection_to_weight(0.0005), "weight = 0.0005 is not allowed: 0.001 to 1000 is");
  EXPECT_NE(objection_to_weight(std::numeric_limits<double>::quiet_NaN()), "");
}

}  // namespace
}  // namespace oblique::protocol
