// Databases that earlier versions of the schema left.
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/model_message.h"
#include "server/care/diagnosis.h"
#include "server/care/merge.h"
#include "server/care/salvage.h"
#include "server/database/row_checksum.h"
#include "server/reading/reader.h"
#include "server/store/rows/row_columns.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kFirstWithChecksums = 4;
constexpr int kFirstWithModelTexts = 5;

/// A database as an earlier version of the schema had it: a study of ten points, of which one
/// failed.
class OldDatabase : public testing::Test {
 protected:
  void make(int version) {
    std::ifstream schema(OBLIQUE_OLD_SCHEMAS "/schema_" + std::to_string(version) + ".sql");
    const std::string sql(std::istreambuf_iterator<char>(schema), {});
    const DatabaseHandle database =
        open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    execute(database.get(), sql);
    execute(database.get(), "PRAGMA application_id = " + std::to_string(kApplicationId));
    execute(database.get(), "PRAGMA user_version = " + std::to_string(version));
    execute(database.get(), "INSERT INTO about (database_id) VALUES ('old')");
    const bool has_share = version >= 2;
    Statement insert(database.get(),
                     "INSERT INTO studies (study_id, name, recipe, points, state, created_at,"
                     " changed_at" +
                         std::string(has_share ? ", priority, weight" : "") +
                         ") VALUES (3, 'old study', ?, 10, 'cancelled', 'then', 'later'" +
                         (has_share ? ", 0, 1)" : ")"));
    insert.bind_blob(1, table_of(10)->recipe().SerializeAsString());
    insert.run();
    add_model(database.get(), 1, {}, version);
    add_failure(database.get(), 2, 1);
    if (version >= kFirstWithChecksums) {
      add_row_checksum(database.get());
      execute(database.get(), "UPDATE results SET checksum = " + result_checksum_sql(version));
      execute(database.get(), "UPDATE studies SET checksum = " + study_checksum_sql());
    }
  }

  static void add_model(sqlite3* database, int model_id, const solver::ModelParameters& model,
                        int version) {
    Statement insert(database,
                     "INSERT INTO models (model_id, links, length, lengths_m, E, A, I, rho, g,"
                     " elements_per_link, k, eta2, tip_mass, integrator, spectral_radius, dt,"
                     " dt_fall, definition) VALUES (?, 3, 0.4, '[0.4,0.4,0.4]', 70e9, 5.309e-4,"
                     " 2.243e-8, 2700.0, 9.81, 4, 2.7e7, 1.2463, 0.0, 'explicit', 0.9, 0.0, 0.0,"
                     " ?)");
    insert.bind(1, std::int64_t{model_id});
    if (version >= kFirstWithModelTexts) {
      insert.bind(2, protocol::canonical_model(model));
    } else {
      insert.bind_blob(2, protocol::to_message(model).SerializeAsString());
    }
    insert.run();
  }

  static void add_failure(sqlite3* database, std::uint64_t number, int model_id) {
    const protocol::Point point = table_of(10)->point(number);
    Statement insert(database,
                     "INSERT INTO results (study_id, point, model_id, H, mu, e, status, error,"
                     " attempt, solved_at) VALUES (3, ?, ?, ?, ?, ?, 'failed', 'why', 1, 'then')");
    insert.bind(1, number);
    insert.bind(2, std::int64_t{model_id});
    insert.bind(3, point.H_m);
    insert.bind(4, point.mu);
    insert.bind(5, point.e_star);
    insert.run();
  }

  std::vector<std::string> texts(const std::string& sql) const {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement statement(database.get(), sql);
    std::vector<std::string> found;
    while (statement.step()) {
      found.push_back(statement.text(0));
    }
    return found;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("old.db");
};

class OldDatabaseTest : public OldDatabase, public testing::WithParamInterface<int> {
 protected:
  OldDatabaseTest() { make(GetParam()); }
};

TEST_P(OldDatabaseTest, IsBroughtToThePresentSchemaAndKeepsItsStudies) {
  Store store(path_);
  EXPECT_EQ(store.database_id(), "old");
  const auto studies = store.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "old study");
  EXPECT_EQ(studies[0].state, StudyState::kCancelled);
  EXPECT_EQ(studies[0].terms, StudyTerms{});
  EXPECT_EQ(studies[0].submitted_by, "");
  EXPECT_EQ(studies[0].settled, IntervalSet(2, 3));
  store.commit(std::vector<Change>{SetStudyState{3, StudyState::kPaused, "now"}});
  EXPECT_EQ(store.studies()[0].state, StudyState::kPaused);
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_P(OldDatabaseTest, IsMergedIntoAPresentOneAndStaysAsItWas) {
  const std::string target = folder_.file("target.db");
  for (const std::uint64_t added : {1U, 0U}) {
    const Merged merged = Merger(target).merge(path_, {}, [](auto, auto) {});
    EXPECT_EQ(merged.studies_added, added);
    EXPECT_EQ(merged.results_added, added);
  }
  EXPECT_THAT(texts("PRAGMA user_version"), ElementsAre(std::to_string(GetParam())));
  EXPECT_THAT(find_faults(target), IsEmpty());
  Store store(target);
  EXPECT_EQ(store.studies().at(0).state, StudyState::kCancelled);
  EXPECT_EQ(store.studies().at(0).settled, IntervalSet(2, 3));
}

TEST_P(OldDatabaseTest, HasTheColumnsAndViewsOfANewOneAfterwards) {
  const std::string fresh = folder_.file("new.db");
  { const Store store(path_); }
  { const Store store(fresh); }
  const auto layout = [](const std::string& path) {
    const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    Statement columns(database.get(),
                      "SELECT t.name || ' ' || c.name || ' ' || c.type || c.\"notnull\" || c.pk"
                      " FROM sqlite_schema AS t, pragma_table_info(t.name) AS c"
                      " WHERE t.type IN ('table', 'view') ORDER BY t.name, c.cid");
    std::vector<std::string> found;
    while (columns.step()) {
      found.push_back(columns.text(0));
    }
    return found;
  };
  EXPECT_EQ(layout(path_), layout(fresh));
}

TEST_P(OldDatabaseTest, CanBeReadAndCheckedAsItIs) {
  Reader reader(path_);
  EXPECT_EQ(reader.query("SELECT name FROM studies", kNoLimits).rows_size(), 1);
  EXPECT_EQ(reader.study_status("old study").at(0).weight(), 1.0);
  EXPECT_EQ(reader.study_status("old study").at(0).submitted_by(), "");
  EXPECT_THAT(find_faults(path_), IsEmpty());
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "UPDATE models SET E = 1");
  EXPECT_THAT(find_faults(path_), ElementsAre("model 1: E is not that of its definition"));
}

TEST_P(OldDatabaseTest, DefinesItsModelsByTheirTextAfterwardsAndNewResultsFindThem) {
  Store store(path_);
  const std::shared_ptr<const protocol::PointTable> table = table_of(10);
  store.commit(std::vector<Change>{
      AddResults{3, table, 0, "0.1", "avx2", 1, "now", {protocol::failed_point(5, "why")}}});
  EXPECT_THAT(texts("SELECT definition FROM models"),
              ElementsAre(protocol::canonical_model(table->model(0))));
  EXPECT_THAT(texts("SELECT count(*) FROM runs WHERE study = 'old study' AND k = 2.7e7"),
              ElementsAre("2"));
  EXPECT_THAT(texts("SELECT tolerance FROM models"), ElementsAre("1.0e-05"));
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_P(OldDatabaseTest, IsSalvagedWithItsModels) {
  const std::string saved = folder_.file("saved.db");
  EXPECT_EQ(salvage(path_, saved).results, 1U);
  EXPECT_THAT(find_faults(saved), IsEmpty());
  path_ = saved;
  EXPECT_THAT(texts("SELECT definition FROM models"),
              ElementsAre(protocol::canonical_model(table_of(10)->model(0))));
}

TEST_P(OldDatabaseTest, HasAStudyThatIsTheOneOfTheSameRecipeWrittenInAnotherWay) {
  Store store(path_);
  const StudyTable stored = store.studies().at(0).table;
  protocol::Recipe recipe = table_of(10)->recipe();
  *recipe.mutable_model() = protocol::to_message(solver::ModelParameters());
  const StudyTable written(std::make_shared<const protocol::PointTable>(recipe));
  EXPECT_NE(stored.recipe_bytes(), written.recipe_bytes());
  EXPECT_TRUE(stored.is_of_the_recipe_of(written));
}

INSTANTIATE_TEST_SUITE_P(EveryEarlierSchema, OldDatabaseTest,
                         testing::Range(1, static_cast<int>(kSchemaVersion)));

TEST_F(OldDatabase, KeepsItsChecksums) {
  make(4);
  const std::string sums = "SELECT checksum FROM studies";
  const auto before = texts(sums);
  ASSERT_THAT(before, testing::SizeIs(1));
  { const Store store(path_); }
  EXPECT_EQ(texts(sums), before);
  EXPECT_THAT(texts("SELECT count(checksum) FROM results"), ElementsAre("1"))
      << "what is stored is another, and so is its checksum";
  EXPECT_THAT(diagnose(path_).remarks, testing::Not(Contains(HasSubstr("no checksum"))));
}

TEST_F(OldDatabase, HasOneModelAfterwardsWhereTwoDifferedInTheSignOfAZero) {
  make(4);
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    solver::ModelParameters same;
    same.dt_s = -0.0;
    add_model(database.get(), 2, same, 4);
    add_failure(database.get(), 7, 2);
    add_row_checksum(database.get());
    execute(database.get(), "UPDATE results SET checksum = " + result_checksum_sql(4));
  }
  { const Store store(path_); }
  EXPECT_THAT(texts("SELECT model_id FROM models"), ElementsAre("1"));
  EXPECT_THAT(texts("SELECT point || ' ' || model_id || ' ' || (checksum IS NULL) FROM results"
                    " ORDER BY point"),
              ElementsAre("2 1 0", "7 1 1"));
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(OldDatabase, WithAModelThatCannotBeReadOpensAndCheckNamesIt) {
  make(4);
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE models SET definition = x'ff'");
  { const Store store(path_); }
  EXPECT_THAT(texts("SELECT definition FROM models"), ElementsAre("unreadable ff"));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("model 1: its definition cannot be read")));
}

}  // namespace
}  // namespace oblique::server
