#include <string>

#include <gtest/gtest.h>

#include "client/service/watching.h"

namespace oblique::client {
namespace {

std::string update(WaitMessages& messages, double elapsed_s, const std::string& waits_for) {
  protocol::StudyStatus status;
  status.set_waits_for(waits_for);
  return messages.update(status, WaitMessages::Seconds{elapsed_s});
}

TEST(WaitMessages, NameOnceWhatAStudyWaitsForAndThatItGoesOn) {
  WaitMessages messages;
  EXPECT_EQ(update(messages, 0, "a worker"), "");
  EXPECT_EQ(update(messages, 1.9, "a worker"), "");
  EXPECT_EQ(update(messages, 2, "a worker"), "The study waits for a worker.");
  EXPECT_EQ(update(messages, 100, "a worker"), "");
  EXPECT_EQ(update(messages, 101, ""), "The study goes on.");
  EXPECT_EQ(update(messages, 102, ""), "");
}

TEST(WaitMessages, PassOverAWaitThatIsSoonOver) {
  WaitMessages messages;
  EXPECT_EQ(update(messages, 0, "a worker"), "");
  EXPECT_EQ(update(messages, 1, ""), "");
  EXPECT_EQ(update(messages, 2, "a worker"), "");
  EXPECT_EQ(update(messages, 3.9, "a worker"), "");
  EXPECT_EQ(update(messages, 4, ""), "");
}

TEST(WaitMessages, NameAReasonThatChanged) {
  WaitMessages messages;
  update(messages, 0, "a worker");
  EXPECT_NE(update(messages, 3, "a worker"), "");
  EXPECT_EQ(update(messages, 4, "the database"), "");
  EXPECT_EQ(update(messages, 6, "the database"), "The study waits for the database.");
}

}  // namespace
}  // namespace oblique::client
