// What completion does with its time; shells are in tests/deploy.
#include <chrono>

#include <gtest/gtest.h>

#include "client/verbs/completion/stored_names.h"

namespace oblique::client {
namespace {

using std::chrono::milliseconds;

TEST(Completion, GivesAServerWhatTheBeginningHasLeftOfTwentyMillisecondsAndAlwaysALittle) {
  EXPECT_LE(milliseconds(6) + patience_left(milliseconds(6)), milliseconds(20));
  EXPECT_LT(patience_left(milliseconds(10)), patience_left(milliseconds(6)));
  EXPECT_GT(patience_left(milliseconds(1000)), milliseconds(0));
}

}  // namespace
}  // namespace oblique::client
