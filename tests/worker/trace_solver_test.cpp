#include "worker/trace_solver.h"

#include <algorithm>
#include <future>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::worker {
namespace {

solver::TraceRow row_at(double t_s) {
  solver::TraceRow row{};
  row.t_s = t_s;
  row.state = t_s < 3 ? "SC" : "sR";
  row.reactions_N = {1, 2};
  return row;
}

protocol::TraceOrder order(std::uint64_t id, std::uint64_t most_bytes = 1 << 20) {
  protocol::TraceOrder order;
  order.set_trace_id(id);
  order.set_most_bytes(most_bytes);
  return order;
}

/// Answers with `rows` rows, as soon as it is let.
class Solving {
 public:
  explicit Solving(int rows) : rows_(rows) {}
  TraceSolver::Solve solve() {
    return [this](const protocol::TraceOrder&, const solver::Tracing::Sink& sink) {
      if (release_) {
        release_->get_future().wait();
      }
      for (int i = 0; i < rows_; ++i) {
        sink(row_at(i));
      }
      protocol::PointResult result;
      result.add_reals(5.0);
      return result;
    };
  }
  void hold() { release_.emplace(); }
  void let() { release_->set_value(); }

 private:
  int rows_;
  std::optional<std::promise<void>> release_;
};

/// All parts until so many that are the last ones.
std::vector<protocol::TracePart> parts_of(TraceSolver& solver, int last_ones = 1) {
  std::vector<protocol::TracePart> all;
  while (last_ones > 0) {
    for (auto& part : solver.collect()) {
      last_ones -= part.last() ? 1 : 0;
      all.push_back(std::move(part));
    }
    std::this_thread::yield();
  }
  return all;
}

TEST(TraceSolverTest, AnOrderIsAnsweredByItsRowsAndInTheEndByItsResult) {
  Solving solving(5);
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  const auto parts = parts_of(solver);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].trace_id(), 7U);
  EXPECT_FALSE(parts[0].not_taken());
  EXPECT_EQ(parts[0].result().reals(0), 5.0);
  const solver::TraceShape one_link{1, 0};
  ASSERT_EQ(parts[0].rows().states().size(), 5U);
  const auto numbers = solver::trace_numbers(one_link);
  ASSERT_EQ(static_cast<std::size_t>(parts[0].rows().values_size()), 5 * numbers);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto row = solver::trace_row(
        one_link, {parts[0].rows().values().data() + i * numbers, numbers},
        solver::kTraceStates.at(static_cast<std::size_t>(parts[0].rows().states()[i])));
    EXPECT_EQ(row.t_s, static_cast<double>(i));
    EXPECT_EQ(row.state, i < 3 ? "SC" : "sR");
    EXPECT_EQ(row.reactions_N, (std::vector<double>{1, 2}));
  }
}

TEST(TraceSolverTest, ALongTraceComesInPartsOfABoundedSize) {
  Solving solving(20'000);
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7, std::uint64_t{1} << 30U));
  std::size_t rows = 0;
  for (const auto& part : parts_of(solver)) {
    EXPECT_LE(part.ByteSizeLong(), std::size_t{300} << 10U);
    rows += part.rows().states().size();
  }
  EXPECT_EQ(rows, 20'000U);
}

TEST(TraceSolverTest, ATraceThatHasMoreThanItMayFailsAndNamesTheBound) {
  Solving solving(100);
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7, 1000));
  const auto parts = parts_of(solver);
  EXPECT_NE(parts.back().result().error().find("1000 bytes"), std::string::npos);
}

/// A fall, and a contact whose force has a narrow peak.
TraceSolver::Solve solving_shapes(int rows, std::size_t nodes) {
  return [rows, nodes](const protocol::TraceOrder&, const solver::Tracing::Sink& sink) {
    solver::TraceRow row = row_at(0);
    row.nodes_m.resize(2 * nodes);
    for (int i = 0; i < solver::kFallRows; ++i) {
      row.t_s = i + 1 - solver::kFallRows;
      row.state = solver::kFalling;
      sink(row);
    }
    for (int i = 0; i < rows; ++i) {
      row.t_s = i;
      row.fn_N = i == rows / 3 ? 100.0 : i % 5;
      row.state = i < rows / 2 ? "SC" : "sR";
      sink(row);
    }
    protocol::PointResult result;
    result.add_reals(5.0);
    return result;
  };
}

struct ThinRows {
  std::vector<double> t_s;
  std::vector<double> fn_N;
  std::string states;
};

ThinRows shapes_within(std::size_t most_bytes, int rows, std::size_t nodes) {
  TraceSolver solver(solving_shapes(rows, nodes), [] {});
  auto wanted = order(7, most_bytes);
  wanted.set_shape(true);
  wanted.set_fall(true);
  solver.take(wanted);
  const std::size_t numbers = solver::trace_numbers({1, nodes});
  ThinRows found;
  for (const auto& part : parts_of(solver)) {
    EXPECT_EQ(part.result().error(), "");
    found.states += part.rows().states();
    for (int i = 0; i < part.rows().values_size(); i += static_cast<int>(numbers)) {
      found.t_s.push_back(part.rows().values(i));
      found.fn_N.push_back(part.rows().values(i + 1));
    }
  }
  EXPECT_LE(found.states.size() * (numbers * sizeof(double) + 1), most_bytes);
  return found;
}

TEST(TraceSolverTest, ShapesThatAreTooManyAreThinnedAndKeepWhatMatters) {
  constexpr std::size_t kMost = std::size_t{8} << 20U;
  for (const auto& [rows, nodes] :
       {std::pair{50'000, std::size_t{145}}, {20'000, std::size_t{4097}}}) {
    const ThinRows thin = shapes_within(kMost, rows, nodes);
    EXPECT_TRUE(std::is_sorted(thin.t_s.begin(), thin.t_s.end()));
    EXPECT_EQ(thin.t_s.front(), 1 - solver::kFallRows) << "release";
    EXPECT_EQ(thin.t_s.back(), rows - 1);
    EXPECT_EQ(std::ranges::count(thin.fn_N, 100.0), 1) << "the peak";
    const auto has = [&thin](double t_s) { return std::ranges::count(thin.t_s, t_s) > 0; };
    EXPECT_TRUE(has(rows / 2 - 1) && has(rows / 2)) << "where the state changes";
    EXPECT_TRUE(has(0.0)) << "touch";
    const auto fall = static_cast<std::size_t>(std::ranges::count(thin.states, '\4'));
    EXPECT_GE(fall, nodes > 1000 ? 20U : 121U);
    EXPECT_GE(thin.t_s.size() - fall, nodes > 1000 ? 40U : 1500U);
    double longest = 0.0;
    for (std::size_t i = fall + 1; i < thin.t_s.size(); ++i) {
      longest = std::max(longest, thin.t_s[i] - thin.t_s[i - 1]);
    }
    EXPECT_LE(longest, nodes > 1000 ? 2048 : 128) << "they lie evenly";
  }
}

TEST(TraceSolverTest, ShapesThatAreFewAreAllThere) {
  const ThinRows all = shapes_within(std::size_t{8} << 20U, 3000, 13);
  EXPECT_EQ(all.t_s.size(), 3000U + solver::kFallRows);
}

TEST(TraceSolverTest, WhileOneIsSolvedAnotherIsNotTaken) {
  Solving solving(1);
  solving.hold();
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  EXPECT_TRUE(solver.is_solving());
  solver.take(order(8));
  const auto refused = parts_of(solver);
  EXPECT_EQ(refused.front().trace_id(), 8U);
  EXPECT_TRUE(refused.front().not_taken());
  solving.let();
  EXPECT_EQ(parts_of(solver).front().trace_id(), 7U);
}

TEST(TraceSolverTest, ACancelledOrderIsAnsweredAsNotTakenAndADroppedOneNotAtAll) {
  Solving solving(1);
  solving.hold();
  TraceSolver solver(solving.solve(), [] {});
  solver.take(order(7));
  solver.cancel(6);  // an unknown one
  solver.cancel(7);
  solving.let();
  const auto parts = parts_of(solver);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_TRUE(parts[0].not_taken());
  EXPECT_EQ(parts[0].rows().states().size(), 0U);

  solving.hold();
  solver.take(order(8));
  solver.drop_all();
  solving.let();
  while (solver.is_solving()) {
    std::this_thread::yield();
  }
  EXPECT_TRUE(solver.collect().empty());
}

}  // namespace
}  // namespace oblique::worker
