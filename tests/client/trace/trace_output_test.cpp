// The same trace in every format.
#include "client/trace/trace_output.h"

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/trace/traced_fall.h"
#include "tests/support/python.h"
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

class TraceArchives : public testing::Test {
 protected:
  void write(const std::vector<solver::TraceRow>& rows, const solver::TraceShape& shape,
             const std::string& name) {
    const std::string file = folder_.file(name);
    TraceOutput output(file, trace_format("", file));
    output.begin(shape);
    for (const auto& row : rows) {
      output.add(row);
    }
    output.finish({}, std::nullopt);
  }
  std::string said(const std::string& program) {
    return oblique::test::said_by_python(folder_,
                                         "import csv, numpy\n"
                                         "a = numpy.load('t.npz')\n"
                                         "rows = list(csv.DictReader(open('t.csv')))\n" +
                                             program);
  }

  oblique::test::TemporaryFolder folder_;
};

TEST_F(TraceArchives, HaveTheNumbersOfTheCsvBitByBitAndNodesAsOneArray) {
  const auto rows = made_up_rows(50, kTwoLinksOfOneElement);
  write(rows, kTwoLinksOfOneElement, "t.npz");
  write(rows, kTwoLinksOfOneElement, "t.csv");
  EXPECT_EQ(said("names = [n for n in rows[0] if not n.startswith('node')]\n"
                 "print(a.files == names + ['nodes_m'], a['nodes_m'].shape)\n"
                 "for n in names:\n"
                 "  kind = str if n == 'state' else float\n"
                 "  assert a[n].tolist() == [kind(r[n]) for r in rows], n\n"
                 "for node in range(3):\n"
                 "  for i, x in enumerate('xy'):\n"
                 "    n = f'node{node}{x}_m'\n"
                 "    assert a['nodes_m'][:, node, i].tolist() == [float(r[n]) for r in rows], n\n"
                 "print(a['t_s'].dtype, a['state'].dtype)"),
            "True (50, 3, 2)\nfloat64 <U2\n");
}

TEST_F(TraceArchives, WithoutTheShapeHaveNoNodes) {
  const solver::TraceShape shape{1, 0};
  write(made_up_rows(1, shape), shape, "t.npz");
  write(made_up_rows(1, shape), shape, "t.csv");
  EXPECT_EQ(said("print(a.files == list(rows[0]), a['fn_N'].shape)"), "True (1,)\n");
}

TEST_F(TraceArchives, OfNoInstantsAreRead) {
  write({}, kTwoLinksOfOneElement, "t.npz");
  write({}, kTwoLinksOfOneElement, "t.csv");
  EXPECT_EQ(said("print(len(rows), a['t_s'].shape, a['nodes_m'].shape)"), "0 (0,) (0, 3, 2)\n");
}

TEST(TraceOutput, ThatIsNotFinishedLeavesWhatWasThere) {
  const oblique::test::TemporaryFolder folder;
  for (const char* name : {"t.csv", "t.npz", "t.json"}) {
    const std::string file = folder.file(name);
    TraceOutput output(file, trace_format("", file));
    output.begin(kTwoLinksOfOneElement);
    output.add(made_up_rows(1, kTwoLinksOfOneElement).front());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(TraceOutput, NamesTheFlagOfAFileThatCannotBeWritten) {
  try {
    const TraceOutput output("/nowhere/t.npz", TraceFormat::kNpz, "--trace");
    ADD_FAILURE() << "it is taken";
  } catch (const solver::InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "--trace /nowhere/t.npz cannot be written: No such file or directory");
  }
}

}  // namespace
}  // namespace oblique::client
