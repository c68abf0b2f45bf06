// What is valid and costly to answer holds up nobody else.
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

/// A study file of `blocks` blocks with 1,024 values an axis: some 80 bytes a block as a recipe.
std::string large_study(const TemporaryFolder& folder, int blocks) {
  const std::string file = folder.file("large.toml");
  std::ofstream out(file);
  out << "[model]\npreset = 'paper'\n";
  for (int i = 0; i < blocks; ++i) {
    out << "[[block]]\nH = { from = " << 0.1 + 1e-6 * i << ", to = 1.0, count = 1024 }\n"
        << "mu = { from = 0.1, to = 1.0, count = 1024 }\ne = 1\n";
  }
  return file;
}

TEST(CostlyTest, WhileALongRecipeIsSubmittedOthersAreAnsweredAndTheirPointsGoOn) {
  const TemporaryFolder folder;
  const Database database(folder.file("some.db"));
  const Server server(folder, folder.file("some.db"));
  const Worker worker(folder, server.worker_url());
  std::vector<std::string> steady{"submit", "--server", server.client_url()};
  const auto points = many_points("steady");
  steady.insert(steady.end(), points.begin(), points.end());
  ASSERT_EQ(run_oblique(folder, steady).exit_code, 0);
  wait_until("points are solved", [&] { return database.rows() > 0; });

  Process large(folder, client_program(),
                {"submit", large_study(folder, 10'000), "--server", server.client_url()});
  int answers = 0;
  while (!large.exit_code()) {
    const Outcome status =
        run_oblique(folder, {"status", "steady", "--server", server.client_url()});
    ASSERT_EQ(status.exit_code, 0) << status.err;
    ++answers;
  }
  EXPECT_EQ(large.wait(), 0) << large.err();
  EXPECT_GT(answers, 0);
  const double rows = database.rows();
  wait_until("the points go on", [&] { return database.rows() > rows; });
  wait_until("those of the large study too", [&] {
    return database.number("SELECT count(*) FROM results WHERE study_id = 2") > 0;
  });
}

}  // namespace
}  // namespace oblique::test
