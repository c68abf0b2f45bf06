#include "client/explore/outputs.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::string error_for(const std::string& text) {
  try {
    outputs_of_flag(text, false);
    return "none";
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(OutputsTest, CommasSeparateColumnsAndConditions) {
  EXPECT_THAT(outputs_of_flag("fn_peak_N, stick_total_s > 0,major_mode = 'sC sR'", false),
              ElementsAre("fn_peak_N", "stick_total_s > 0", "major_mode = 'sC sR'"));
  EXPECT_THAT(outputs_of_flag("major_mode", true), ElementsAre("major_mode"));
}

TEST(OutputsTest, ErrorsNameTheOutputAndWhatIsAllowed) {
  EXPECT_THAT(error_for("fn_peek_N"), HasSubstr("did you mean `fn_peak_N`?"));
  EXPECT_THAT(error_for("fn_peaks_N"), HasSubstr("lists"));
  EXPECT_THAT(error_for("mu,,e"), HasSubstr("unknown output"));
  EXPECT_THAT(error_for("mode"), HasSubstr("mode = 'sC sR'"));
  EXPECT_THAT(error_for("mu; DROP TABLE runs"), HasSubstr("--of"));
}

TEST(OutputsTest, CommasInBracketsDoNotSeparate) {
  EXPECT_THAT(outputs_of_flag("max(fn_peak_N, ft_peak_N),if(mu > 0.5, 1, 0)", false),
              ElementsAre("max(fn_peak_N, ft_peak_N)", "if(mu > 0.5, 1, 0)"));
}

TEST(OutputsTest, TypingErrorsAreFoundBeforeAnythingIsSolved) {
  EXPECT_THAT(error_for("stick_totl_s > 0"),
              AllOf(HasSubstr("--of \"(stick_totl_s > 0)\""), HasSubstr("`stick_total_s`")));
  EXPECT_THAT(error_for("fn_peak_N >"), HasSubstr("--of"));
  EXPECT_THAT(error_for("lg(mu)"), HasSubstr("no such function: lg"));
  EXPECT_THAT(error_for("mu ^ 2"), HasSubstr("pow(a, b)"));
  EXPECT_THAT(error_for("avg(mu) > 1"), HasSubstr("one value for all points"));
  EXPECT_THAT(error_for("E > 1"), HasSubstr("E_Pa"));
  EXPECT_THAT(error_for("*"), HasSubstr("--of"));
  EXPECT_THAT(error_for("mu AS x"), HasSubstr("--of"));
}

TEST(OutputsTest, AnInfiniteValueIsNoNumber) {
  EXPECT_TRUE(std::isnan(number_in(-std::numeric_limits<double>::infinity())));
  EXPECT_EQ(number_in(std::int64_t{3}), 3.0);
}

}  // namespace
}  // namespace oblique::client
