#include "server/result_row.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/results.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

TEST(ResultRow, ANumberThatTheDatabaseCannotHoldFailsItsPoint) {
  EXPECT_EQ(fault_of(solved_point(1)), "");
  auto most = solved_point(1);
  most.set_steps(INT64_MAX);
  EXPECT_EQ(fault_of(most), "");
  auto too_many = solved_point(1);
  too_many.set_steps(UINT64_MAX);
  EXPECT_THAT(fault_of(too_many), HasSubstr("steps = 18446744073709551615"));
  auto no_such_peak = solved_point(1);
  no_such_peak.add_major_peaks(2);  // it has two
  EXPECT_THAT(fault_of(no_such_peak), HasSubstr("major peak"));
}

}  // namespace
}  // namespace oblique::server
