#include "proto/recipe/model_message.h"

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

TEST(ModelMessageTest, AModelComesBackFromItsMessageUnchanged) {
  EXPECT_EQ(from_message(to_message(unusual_model())), unusual_model());
  for (const auto name : solver::preset_names()) {
    EXPECT_EQ(from_message(to_message(solver::preset(name))), solver::preset(name));
  }
}

TEST(ModelMessageTest, AModelComesBackFromAFrameUnchanged) {
  ModelParameters message;
  ASSERT_TRUE(decode(encode(to_message(unusual_model())), message));
  EXPECT_EQ(from_message(message), unusual_model());
}

TEST(ModelMessageTest, WholeNumbersThatNoModelCouldHoldAreRefused) {
  ModelParameters message = to_message(solver::ModelParameters{});
  message.set_elements_per_link(4'000'000'000U);
  EXPECT_THROW(from_message(message), solver::InputError);
  message = to_message(solver::ModelParameters{});
  message.set_integrator(4'000'000'000U);
  EXPECT_THROW(from_message(message), solver::InputError);
}

TEST(ModelMessageTest, AModelOfAnOlderClientHasTheDefaultTolerance) {
  ModelParameters message = to_message(unusual_model());
  message.clear_tolerance();
  EXPECT_EQ(from_message(message).tolerance, solver::ModelParameters{}.tolerance);
  message.set_tolerance(-1e-5);
  EXPECT_THROW(from_message(message), solver::InputError);
}

TEST(ModelMessageTest, AModelWithNothingSetIsRefused) {
  EXPECT_THROW(from_message(ModelParameters{}), solver::InputError);
}

TEST(ModelMessageTest, AModelOutsideItsDomainCanBeReadUnjudged) {
  ModelParameters message = to_message(unusual_model());
  message.set_spectral_radius(1.0);
  EXPECT_THROW(from_message(message), solver::InputError);
  EXPECT_EQ(unjudged_from_message(message).spectral_radius, 1.0);
}

}  // namespace
}  // namespace oblique::protocol
