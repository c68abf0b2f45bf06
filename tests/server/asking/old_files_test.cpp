// Questions to databases that earlier versions of the schema left, read as they are.
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/asking/plan.h"
#include "server/database/open_for_reading.h"
#include "server/reading/query_rules.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class OldFile : public testing::TestWithParam<int> {
 protected:
  OldFile() {
    std::ifstream schema(OBLIQUE_OLD_SCHEMAS "/schema_" + std::to_string(GetParam()) + ".sql");
    const std::string sql(std::istreambuf_iterator<char>(schema), {});
    const DatabaseHandle made = open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    execute(made.get(), "PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY");
    execute(made.get(), sql);
    execute(made.get(), "PRAGMA application_id = " + std::to_string(kApplicationId));
    execute(made.get(), "PRAGMA user_version = " + std::to_string(GetParam()));
    Statement study(made.get(),
                    std::string("INSERT INTO studies (study_id, name, recipe, points, state, "
                                "created_at, changed_at") +
                        (GetParam() >= 2 ? ", priority, weight" : "") +
                        ") VALUES (3, 'old', ?, 10, 'done', 'then', 'later'" +
                        (GetParam() >= 2 ? ", 0, 1)" : ")"));
    study.bind_blob(1, table_of(10)->recipe().SerializeAsString());
    study.run();
    execute(made.get(),
            "INSERT INTO models (model_id, links, length, lengths_m, E, A, I, rho, g,"
            " elements_per_link, k, eta2, tip_mass, integrator, spectral_radius, dt, dt_fall,"
            " definition) VALUES (1, 3, 0.4, '[0.4]', 70e9, 5.3e-4, 2.2e-8, 2700.0, 9.81, 4,"
            " 2.7e7, 1.2463, 0.0, 'explicit', 0.9, 0.0, 0.0, " +
                std::string(GetParam() >= 5 ? "'m')" : "x'00')"));
    execute(made.get(),
            "INSERT INTO results (study_id, point, model_id, H, mu, e, status, fn_peak_N, peaks,"
            " attempt, solved_at) VALUES (3, 9, 1, 1.0, 1.0, 1.0, 'solved', 5.0,"
            " '[[0.5,2.5,1.0,1]]', 1, 'then'), (3, 2, 1, 1.0, 0.2222222222222222, 1.0, 'solved',"
            " 7.0, 'damaged', 1, 'then')");
    database_ = open_for_reading(path_).database;
    restrict_to_reading(database_.get());
  }

  static protocol::StudyQuery question(const std::string& select) {
    protocol::StudyQuery question;
    question.set_study("old");
    if (!select.empty()) {
      question.add_select(select);
    }
    return question;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("old.db");
  DatabaseHandle database_;
};

TEST_P(OldFile, AnswersAsItIs) {
  auto asked = question("fn_peak_N, k");
  asked.set_where("mu > 0.5");
  Statement answer(database_.get(), plan(database_.get(), asked).statement);
  ASSERT_TRUE(answer.step());
  EXPECT_EQ(answer.real(0), 5.0);
  EXPECT_FALSE(answer.step());
  Statement usual(database_.get(), plan(database_.get(), question("")).statement);
  ASSERT_TRUE(usual.step());
  EXPECT_EQ(usual.integer(0), 2);
}

TEST_P(OldFile, ADamagedListHasNoElements) {
  Statement answer(database_.get(), plan(database_.get(), question("peaks[0].fn_N, peaks.count, "
                                                                   "largest_peak.t_s, peaks[0]"))
                                        .statement);
  ASSERT_TRUE(answer.step());
  EXPECT_TRUE(answer.is_null(0) && answer.is_null(1) && answer.is_null(2) && answer.is_null(3));
  ASSERT_TRUE(answer.step());
  EXPECT_EQ(answer.real(0), 2.5);
  EXPECT_EQ(answer.integer(1), 1);
  EXPECT_EQ(answer.real(2), 0.5);
}

TEST_P(OldFile, AColumnThatCameLaterIsNamedWithTheWayOut) {
  const std::string later = GetParam() < 7 ? "margin" : "taken_from";
  try {
    plan(database_.get(), question(later));
    FAIL() << "it has " << later;
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr(later), HasSubstr("earlier version"), HasSubstr("oblique backup")));
  }
}

INSTANTIATE_TEST_SUITE_P(Schemas, OldFile, testing::Range(1, 8));

}  // namespace
}  // namespace oblique::server
