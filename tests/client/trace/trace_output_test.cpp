// Where a trace goes, and what of it is the fall.
#include "client/trace/trace_output.h"

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/trace/worker_trace.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr solver::TraceShape kTwoLinksOfOneElement{2, 3};

/// Rows of which no two numbers are equal, and few have a short text.
std::vector<solver::TraceRow> made_up_rows(std::size_t count, const solver::TraceShape& shape) {
  std::vector<solver::TraceRow> rows;
  std::vector<double> numbers(solver::trace_numbers(shape));
  double next = -1.0 / 3.0;
  for (std::size_t i = 0; i < count; ++i) {
    for (double& number : numbers) {
      number = next *= -1.0078125;
    }
    numbers.front() = i == 0 ? std::numeric_limits<double>::denorm_min() : numbers.front();
    rows.push_back(trace_row(shape, numbers, solver::kTraceStates.at(i % 4)));
  }
  return rows;
}

TEST(TracedFall, IsTakenOffTheFrontAndLeavesTheContact) {
  const auto taken = [](std::size_t falling, std::size_t touching) {
    std::vector<solver::TraceRow> rows(falling + touching);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].t_s = static_cast<double>(i);
      rows[i].state = i < falling ? solver::kFalling : "sC";
    }
    const auto fall = take_fall(rows);
    EXPECT_EQ(fall.size(), falling);
    EXPECT_EQ(rows.size(), touching);
    EXPECT_TRUE(fall.empty() || fall.back().t_s == static_cast<double>(falling) - 1.0);
    EXPECT_TRUE(rows.empty() || rows.front().t_s == static_cast<double>(falling));
  };
  taken(3, 2);
  taken(0, 2);
  taken(3, 0);
  taken(0, 0);
}

TEST(TraceOutput, ThatIsNotFinishedLeavesWhatWasThere) {
  const oblique::test::TemporaryFolder folder;
  for (const char* name : {"t.csv", "t.json"}) {
    const std::string file = folder.file(name);
    TraceOutput output(file, format_of_output("", file));
    output.begin(kTwoLinksOfOneElement);
    output.add(made_up_rows(1, kTwoLinksOfOneElement).front());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(TraceOutput, NamesTheFlagOfAFileThatCannotBeWritten) {
  try {
    const TraceOutput output("/nowhere/t.csv", Format::kCsv, "--trace");
    ADD_FAILURE() << "it is taken";
  } catch (const solver::InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "--trace /nowhere/t.csv cannot be written: No such file or directory");
  }
}

}  // namespace
}  // namespace oblique::client
