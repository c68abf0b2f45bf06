#include "client/explore/outputs.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> sql_of(const std::string& text) {
  std::vector<std::string> sql;
  for (const Output& output : outputs_of_flag("--of", text)) {
    sql.push_back(output.sql);
  }
  return sql;
}

std::string objection_to(const std::string& text) {
  try {
    for (const Output& output : outputs_of_flag("--of", text)) {
      refuse_texts("--of", output);
    }
    return "none";
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(OutputsTest, CommasSeparateThemOutsideQuotesAndBracketsOnly) {
  EXPECT_THAT(sql_of("fn_peak_N, duration_s"), ElementsAre("fn_peak_N", "duration_s"));
  EXPECT_THAT(sql_of("max(fn_peak_N, ft_peak_N),mu"),
              ElementsAre("max(fn_peak_N, ft_peak_N)", "mu"));
  EXPECT_THAT(sql_of("mode IN ('a,b'),mu"), ElementsAre("mode IN ('a,b')", "mu"));
}

TEST(OutputsTest, AModeIsAConditionWithAndWithoutQuotes) {
  EXPECT_THAT(sql_of("mode:'sC sR',major_mode:SC SR"),
              ElementsAre("mode = 'sC sR'", "major_mode = 'SC SR'"));
  EXPECT_THAT(sql_of("mode:it's"), ElementsAre("mode = 'it''s'"));
}

TEST(OutputsTest, WrongOnesAreNamedWithWhatIsAllowed) {
  EXPECT_THAT(objection_to("fn_peek_N"), HasSubstr("did you mean `fn_peak_N`?"));
  EXPECT_THAT(objection_to("fn_peaks_N"), HasSubstr("lists"));
  EXPECT_THAT(objection_to("mu,,e"), HasSubstr("an output is missing"));
  EXPECT_THAT(objection_to("mode"), HasSubstr("mode:'sC sR'"));
  EXPECT_THAT(objection_to("mu; DROP TABLE runs"), HasSubstr("--of"));
  EXPECT_EQ(objection_to("mode:'sC sR',stick_total_s > 0"), "none");
}

}  // namespace
}  // namespace oblique::client
