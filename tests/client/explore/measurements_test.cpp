#include "client/explore/measurements.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

Measurements measured(const std::string& text, double relative_sd = 0.0) {
  return read_measurements(CsvFile(text, "measured.csv"), relative_sd);
}

std::string objection_to_file(const std::string& text, double relative_sd = 0.0) {
  try {
    measured(text, relative_sd);
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Measurements, AreNumbersWithDeviationsUnderTheConditionsOfTheirRow) {
  const auto found = measured(
      "H,mu,E_Pa,fn_peak_N,fn_peak_N_sd,duration_s\n"
      "1,0.4,7e10,5058,50,\n"
      "0.9,0.6,6e10,4700,,5e-4\n",
      0.01);
  EXPECT_EQ(found.rows, 2U);
  EXPECT_THAT(found.conditions,
              ElementsAre(Pair("H", ElementsAre(1.0, 0.9)), Pair("mu", ElementsAre(0.4, 0.6)),
                          Pair("E", ElementsAre(7e10, 6e10))));
  ASSERT_EQ(found.outputs.size(), 2U);
  EXPECT_EQ(found.outputs[1], "duration_s");
  ASSERT_EQ(found.numbers.size(), 3U);  // an empty field is no measurement
  EXPECT_EQ(found.numbers[0].value, 5058.0);
  EXPECT_EQ(found.numbers[0].sd, 50.0);
  EXPECT_EQ(found.numbers[1].row, 1U);
  EXPECT_DOUBLE_EQ(found.numbers[1].sd, 47.0);  // 1 % of the value, because the sd field is empty
  EXPECT_EQ(found.numbers[2].output, 1U);
  EXPECT_DOUBLE_EQ(found.numbers[2].sd, 5e-6);
  EXPECT_EQ(found.numbers[2].name, "measured.csv:3: duration_s");
}

TEST(Measurements, NameWhatIsWrongInAFile) {
  EXPECT_THAT(objection_to_file("H,fn_peak\n1,2\n", 0.01),
              HasSubstr("a column `fn_peak` (did you mean `fn_peak_N`?)"));
  EXPECT_THAT(objection_to_file("H,mode\n1,2\n", 0.01), HasSubstr("a column `mode`"));
  EXPECT_THAT(objection_to_file("H,fn_peak_N\n1,2\n"),
              HasSubstr("measured.csv:2: fn_peak_N has no standard deviation: fill in the column "
                        "fn_peak_N_sd, or give --sd 1%"));
  EXPECT_THAT(objection_to_file("H,fn_peak_N,fn_peak_N_sd\n1,2,-3\n"),
              HasSubstr("a standard deviation that is not positive"));
  EXPECT_THAT(objection_to_file("H,stick_total_s\n1,0\n", 0.01),
              HasSubstr("stick_total_s is 0, so --sd gives no standard deviation: fill in the "
                        "column stick_total_s_sd"));
  EXPECT_THAT(objection_to_file("H,fn_peak_N_sd\n1,2\n"), HasSubstr("a column `fn_peak_N_sd`"));
  EXPECT_THAT(objection_to_file("H,mu\n1,2\n"), HasSubstr("no measured output"));
  EXPECT_THAT(objection_to_file("H,fn_peak_N\n-1,2\n", 0.01),
              HasSubstr("measured.csv:2: column `H`"));
  EXPECT_THAT(objection_to_file("H,fn_peak_N\n1,many\n", 0.01),
              HasSubstr("\"many\" is not a number"));
}

}  // namespace
}  // namespace oblique::client
