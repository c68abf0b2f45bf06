#include "client/explore/outputs.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

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

}  // namespace
}  // namespace oblique::client
