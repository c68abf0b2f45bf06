// Output of a trace to a file, and separation of the fall from the contact.
#include "client/trace/solve_again.h"

#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

TEST(TakeFall, MovesTheRowsOfTheFallOutOfATrace) {
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

TEST(TraceOutput, NamesTheFlagOfAFileThatCannotBeWritten) {
  try {
    const TraceOutput output("/nowhere/t.csv", Format::kCsv, "--trace");
    ADD_FAILURE() << "an unwritable file was accepted";
  } catch (const solver::InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "--trace /nowhere/t.csv cannot be written: No such file or directory");
  }
}

}  // namespace
}  // namespace oblique::client
