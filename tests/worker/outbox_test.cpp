#include "worker/outbox.h"

#include <cstdint>

#include <gtest/gtest.h>

#include "proto/result_message.h"

namespace oblique::worker {
namespace {

protocol::Results results_of(std::uint64_t study_id, int count) {
  protocol::Results results;
  results.set_study_id(study_id);
  results.set_lease_id(5);
  results.set_batch_done(true);
  for (int i = 0; i < count; ++i) {
    *results.add_results() = protocol::failed_point(static_cast<std::uint64_t>(i), "for the test");
  }
  return results;
}

OutboxLimits one_at_a_time() {
  OutboxLimits limits;
  limits.messages_on_their_way = 1;
  return limits;
}

TEST(Outbox, SendsInOrderAsFarAsItsWindowReaches) {
  Outbox outbox(one_at_a_time());
  outbox.add(results_of(7, 1));
  outbox.add(results_of(7, 2));
  const protocol::Results* first = outbox.next_to_send();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->sequence(), 1U);
  EXPECT_EQ(outbox.next_to_send(), nullptr);
  EXPECT_TRUE(outbox.has_waiting());
  outbox.acknowledged(99);  // nobody sent it
  EXPECT_EQ(outbox.next_to_send(), nullptr);
  outbox.acknowledged(1);
  EXPECT_EQ(outbox.results(), 2U);
  const protocol::Results* second = outbox.next_to_send();
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(second->sequence(), 2U);
  outbox.acknowledged(2);
  EXPECT_TRUE(outbox.is_empty());
  EXPECT_EQ(outbox.results(), 0U);
}

TEST(Outbox, OfADroppedStudyNothingIsLeftAndItsPlacesInTheWindowAreFree) {
  Outbox outbox(one_at_a_time());
  outbox.add(results_of(7, 3));
  outbox.add(results_of(8, 2));
  outbox.add(results_of(7, 1));
  ASSERT_NE(outbox.next_to_send(), nullptr);
  outbox.drop_study(7);
  EXPECT_EQ(outbox.results(), 2U);
  const protocol::Results* next = outbox.next_to_send();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->study_id(), 8U);
}

TEST(Outbox, ANewSessionSendsAllAgainAndEndsNoLeaseOfTheOldOne) {
  Outbox outbox({});
  outbox.add(results_of(7, 1));
  outbox.add(results_of(8, 1));
  while (outbox.next_to_send() != nullptr) {
  }
  outbox.start_over();
  for (const std::uint64_t sequence : {1U, 2U}) {
    const protocol::Results* again = outbox.next_to_send();
    ASSERT_NE(again, nullptr);
    EXPECT_EQ(again->sequence(), sequence);
    EXPECT_EQ(again->lease_id(), 0U);
    EXPECT_FALSE(again->batch_done());
  }
}

TEST(Outbox, IsFullByResultsAndByBytesUntilTheyAreAcknowledged) {
  OutboxLimits few;
  few.unacknowledged_results = 2;
  OutboxLimits small;
  small.unacknowledged_bytes = 1;
  for (const OutboxLimits& limits : {few, small}) {
    Outbox outbox(limits);
    EXPECT_FALSE(outbox.is_full());
    outbox.add(results_of(7, 2));
    EXPECT_TRUE(outbox.is_full());
    outbox.acknowledged(1);
    EXPECT_FALSE(outbox.is_full());
  }
}

}  // namespace
}  // namespace oblique::worker
