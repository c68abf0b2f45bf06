// A run whose workers may not solve what is left ends and says so.
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/study_file.h"
#include "server/store/store.h"
#include "tests/client/study/pretended_fall.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

constexpr const char* kBegun = R"(name = "begun"
[model]
elements_per_link = 1
[[block]]
H = 0.9
mu = [0.2, 0.4, 0.6]
e = 0.8
)";

/// A folder with begun.toml and a database in which solver 0.1 has solved its first point.
class BegunByAnotherSolver : public testing::Test {
 protected:
  BegunByAnotherSolver() {
    std::ofstream(folder_.path() / "begun.toml") << kBegun;
    const Study study = parse_study(kBegun, "begun.toml", pretended_reach());
    const auto table = std::make_shared<const protocol::PointTable>(study.recipe);
    server::Store store((folder_.path() / "oblique.db").string());
    constexpr const char* kThen = "2024-01-01T00:00:00.000Z";
    const std::vector<server::Change> changes{
        server::AddStudy{1, study.name, table, kThen},
        server::AddWorker{1, "ann", 1, "0.1", "avx2", kThen},
        server::AddResults{1, table, 1, "0.1", "avx2", 1, kThen, {server::solved_point(0)}}};
    store.commit(changes);
  }

  test::TemporaryFolder folder_;
};

TEST_F(BegunByAnotherSolver, IsNotWaitedForAndTheWaysOutAreNamed) {
  const auto outcome = test::run_oblique(folder_, {"run", "begun.toml"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("are of solver 0.1, and the workers here have "));
  EXPECT_THAT(outcome.err, HasSubstr("its other 2 points"));
  EXPECT_THAT(outcome.err, HasSubstr("--name begun-"));
  EXPECT_THAT(test::run_oblique(folder_, {"status"}).out, HasSubstr("0.1\n"))
      << "a file says it as a server does";
}

}  // namespace
}  // namespace oblique::client
