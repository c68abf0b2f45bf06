#include "worker/trace_solver.h"

#include <algorithm>
#include <future>
#include <optional>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::worker {
namespace {

solver::TraceRow row_at(double t_s, std::string_view state = "SC") {
  solver::TraceRow row{};
  row.t_s = t_s;
  row.state = state;
  row.reactions_N = {1, 2};
  return row;
}

const std::size_t kNumbers = solver::trace_numbers({1, 0});
const std::size_t kRowBytes = kNumbers * sizeof(double) + 1;

protocol::TraceOrder order(std::uint64_t id, std::uint64_t every = 1) {
  protocol::TraceOrder order;
  order.set_trace_id(id);
  order.set_every(every);
  return order;
}

/// Solves each trace with 5 rows. After `hold`, a trace first waits for `release`.
class Solving {
 public:
  TraceSolver::Solve solve() {
    return [this](const protocol::TraceOrder&, const solver::Tracing::Sink& sink) {
      if (release_) {
        release_->get_future().wait();
      }
      for (int i = 0; i < 5; ++i) {
        sink(row_at(i, i < 3 ? "SC" : "sR"));
      }
      protocol::PointResult result;
      result.add_reals(5.0);
      return result;
    };
  }
  void hold() { release_.emplace(); }
  void release() { release_->set_value(); }

 private:
  std::optional<std::promise<void>> release_;
};

protocol::Trace answer_of(TraceSolver& solver) {
  while (true) {
    if (auto traces = solver.collect(); !traces.empty()) {
      return traces.at(0);
    }
    std::this_thread::yield();
  }
}

/// Passes a fall of 3 rows and a contact of `instants` rows to TraceRows, which keep at most
/// `most_rows` rows. The second third of the contact is restitution. Fills `trace` and returns the
/// times of its rows.
std::vector<double> times_of(std::uint64_t every, int instants, std::size_t most_rows,
                             protocol::Trace& trace) {
  trace.Clear();
  TraceRows rows(every, most_rows * kRowBytes);
  for (int i = -3; i < 0; ++i) {
    rows.add(row_at(i, solver::kFalling));
  }
  for (int i = 0; i < instants; ++i) {
    const bool compresses = i < instants / 3 || i >= 2 * instants / 3;
    rows.add(row_at(i, compresses ? "sC" : "SR"));
  }
  rows.move_to(trace);
  std::vector<double> times;
  for (int i = 0; i < trace.values_size(); i += static_cast<int>(kNumbers)) {
    times.push_back(trace.values(i));
  }
  EXPECT_EQ(trace.states().size(), times.size());
  EXPECT_LE(times.size(), most_rows);
  return times;
}

TEST(TraceRowsTest, RowsAreTheFallEachKthInstantAllEndsOfPhasesAndTheLastInstant) {
  protocol::Trace trace;
  EXPECT_EQ(times_of(10, 39, 100, trace),
            (std::vector<double>{-3, -2, -1, 0, 10, 13, 20, 26, 30, 38}));
  EXPECT_EQ(trace.states(), std::string("\4\4\4\2\2\1\1\2\2\2", 10));
  EXPECT_EQ(trace.instants(), 39U);
  EXPECT_EQ(trace.every(), 10U);
  EXPECT_EQ(times_of(1, 39, 42, trace).size(), 42U);
}

TEST(TraceRowsTest, TooManyRowsAreRefusedWithAnIntervalThatFits) {
  for (const auto& [every, instants, most] :
       {std::tuple{std::uint64_t{1}, 39, std::size_t{41}}, {1, 100'000, 500}, {7, 10'000, 20}}) {
    protocol::Trace refused;
    EXPECT_TRUE(times_of(every, instants, most, refused).empty());
    EXPECT_EQ(refused.instants(), static_cast<std::uint64_t>(instants));
    ASSERT_GT(refused.every(), every);
    protocol::Trace trace;
    EXPECT_FALSE(times_of(refused.every(), instants, most, trace).empty()) << refused.every();
  }
}

TEST(TraceRowsTest, IfNoIntervalFitsTheAnswerExceedsTheNumberOfInstants) {
  protocol::Trace trace;
  // The rows of the fall, the ends of phases and the last row are already more than 5 rows.
  EXPECT_TRUE(times_of(1, 100, 5, trace).empty());
  EXPECT_EQ(trace.every(), trace.instants() + 1);
}

TEST(TraceRowsTest, WithoutAnIntervalTheSmallestPowerOfTwoThatFitsIsChosen) {
  protocol::Trace trace;
  const auto times = times_of(0, 100'000, 500, trace);
  EXPECT_EQ(trace.every(), 256U);
  EXPECT_EQ(times, times_of(256, 100'000, 500, trace));
  EXPECT_EQ(times_of(0, 30, 500, trace).size(), 33U) << "all rows if they fit";
}

TEST(TraceSolverTest, AnOrderIsAnsweredWithRowsAndResult) {
  Solving solving;
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  const auto trace = answer_of(solver);
  EXPECT_EQ(trace.trace_id(), 7U);
  EXPECT_FALSE(trace.declined());
  EXPECT_EQ(trace.result().reals(0), 5.0);
  EXPECT_EQ(trace.states(), std::string("\0\0\0\3\3", 5));
  ASSERT_EQ(static_cast<std::size_t>(trace.values_size()), 5 * kNumbers);
  const auto row =
      solver::trace_row({1, 0}, {trace.values().data() + 3 * kNumbers, kNumbers}, "sR");
  EXPECT_EQ(row.t_s, 3.0);
  EXPECT_EQ(row.reactions_N, (std::vector<double>{1, 2}));
}

TEST(TraceSolverTest, ASecondOrderIsDeclinedWhileOneIsSolved) {
  Solving solving;
  solving.hold();
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  EXPECT_TRUE(solver.is_solving());
  solver.take(order(8));
  const auto refused = answer_of(solver);
  EXPECT_EQ(refused.trace_id(), 8U);
  EXPECT_TRUE(refused.declined());
  solving.release();
  EXPECT_EQ(answer_of(solver).trace_id(), 7U);
}

TEST(TraceSolverTest, ACancelledOrderIsDeclinedAndADroppedOrderIsNotAnswered) {
  Solving solving;
  solving.hold();
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  solver.cancel(6);  // unknown
  solver.cancel(7);
  solving.release();
  const auto trace = answer_of(solver);
  EXPECT_TRUE(trace.declined());
  EXPECT_EQ(trace.states().size(), 0U);

  solving.hold();
  solver.take(order(8));
  solver.drop_all();
  solving.release();
  while (solver.is_solving()) {
    std::this_thread::yield();
  }
  EXPECT_TRUE(solver.collect().empty());
}

}  // namespace
}  // namespace oblique::worker
