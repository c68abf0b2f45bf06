// Rows of the fall in a trace: who gets them, and what a worker may send.
#include "server/service/traces/trace_orders.h"

#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/support/points.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class TracesWithFall : public testing::Test {
 protected:
  TracesWithFall() { orders_.joined(kWorker, "ann", "1.0", "avx2"); }

  /// Asks for a point and gives the order that the worker is sent; without any when the answer is
  /// there already.
  protocol::TraceOrder ask(std::uint64_t point, bool fall) {
    TracedPoint traced;
    traced.model = protocol::to_message(solver::preset("paper"));
    TraceQuestion question{++ticket_, {1, point, false, fall}};
    orders_.order(question, traced, "1.0", 0);
    return taken<SendOrder>().order;
  }
  /// One row for each state.
  static protocol::TracePart part_of(const protocol::TraceOrder& order, const std::string& states) {
    protocol::TracePart part;
    part.set_trace_id(order.trace_id());
    const std::size_t numbers = solver::trace_numbers(solver::trace_shape(3, 4, false));
    for (std::size_t i = 0; i < states.size() * numbers; ++i) {
      part.mutable_rows()->add_values(1.0);
    }
    part.mutable_rows()->set_states(states);
    return part;
  }
  void send(const protocol::TraceOrder& order, const std::string& states) {
    orders_.part(kWorker, part_of(order, states));
  }
  void send_last(const protocol::TraceOrder& order, const std::string& states) {
    protocol::TracePart part = part_of(order, states);
    part.set_last(true);
    *part.mutable_result() = solved_point(0);
    orders_.part(kWorker, part);
  }
  std::string states_given() { return taken<AnswerTrace>().reply.rows().states(); }
  std::string refusal() { return taken<RefuseTrace>().reason; }

 private:
  static constexpr WorkerId kWorker = 1;

  template <class Effect>
  Effect taken() {
    for (const TraceEffect& effect : orders_.take_effects()) {
      if (const auto* wanted = std::get_if<Effect>(&effect)) {
        return *wanted;
      }
    }
    return {};
  }

  TraceOrders orders_{{}, "1.0"};
  std::uint64_t ticket_ = 0;
};

TEST_F(TracesWithFall, AreOrderedForThoseAloneWhoAskForThem) {
  const auto without = ask(3, false);
  EXPECT_FALSE(without.fall());
  send_last(without, "\x02\x03");
  EXPECT_EQ(states_given(), "\x02\x03");
  const auto with = ask(3, true);
  EXPECT_TRUE(with.fall()) << "the kept one has no fall";
  send(with, "\x04");
  send_last(with, "\x04\x02\x03");
  EXPECT_EQ(states_given(), "\x04\x04\x02\x03");
  EXPECT_EQ(ask(3, true).trace_id(), 0U) << "and now it is kept too";
}

TEST_F(TracesWithFall, HaveNoneFromAnOlderWorker) {
  send_last(ask(3, true), "\x02\x03");
  EXPECT_EQ(states_given(), "\x02\x03");
}

TEST_F(TracesWithFall, FailWhenAWorkerSendsRowsOfTheFallUnaskedOrBehindTheContact) {
  send_last(ask(3, false), "\x04\x02");
  EXPECT_THAT(refusal(), HasSubstr("rows of the fall, unasked"));
  send_last(ask(4, true), "\x04\x02\x04");
  EXPECT_THAT(refusal(), HasSubstr("falls again"));
  const auto order = ask(5, true);
  send(order, "\x02");
  send_last(order, "\x04");
  EXPECT_THAT(refusal(), HasSubstr("falls again"));
}

}  // namespace
}  // namespace oblique::server
