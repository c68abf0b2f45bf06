// Studies of many models in the database.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/query/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

/// `models` values of k, each with two points.
std::shared_ptr<const protocol::PointTable> table_of_stiffnesses(std::uint64_t models) {
  return std::make_shared<const protocol::PointTable>(
      protocol::recipe_of({{protocol::range("k", 1e7, 2e7, models), protocol::listed("H", {1.0}),
                            protocol::listed("mu", {0.4, 0.8}), protocol::listed("e", {1.0})}}));
}

class StoreModels : public testing::Test {
 protected:
  void add_study(std::uint64_t id, const std::string& name,
                 std::shared_ptr<const protocol::PointTable> table) {
    tables_[id] = table;
    const std::vector<Change> changes{AddStudy{id, name, std::move(table), "now"}};
    store_.commit(changes);
  }
  void add_results(std::uint64_t study, const std::vector<std::uint64_t>& points) {
    AddResults results{study, tables_.at(study), 0, "", "", 1, "now", {}};
    for (const std::uint64_t point : points) {
      results.results.push_back(solved_point(point));
    }
    const std::vector<Change> changes{results};
    store_.commit(changes);
  }
  std::int64_t number(const std::string& sql) {
    return Reader(path_).query(sql, kNoLimits).rows(0).values(0).integer();
  }
  /// Rows whose model has the k that the study says.
  std::uint64_t rows_of_right_models(std::uint64_t study) {
    const auto reply = Reader(path_).query(
        "SELECT point, k FROM results JOIN models USING (model_id) WHERE study_id = " +
            std::to_string(study),
        kNoLimits);
    std::uint64_t right = 0;
    for (const auto& row : reply.rows()) {
      const auto& table = *tables_.at(study);
      const auto point = table.point(static_cast<std::uint64_t>(row.values(0).integer()));
      right += table.model(point.model).k_N_m == row.values(1).real() ? 1U : 0U;
    }
    return right;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  Store store_{path_};
  std::map<std::uint64_t, std::shared_ptr<const protocol::PointTable>> tables_;
};

TEST_F(StoreModels, ResultsOfOneMessageAreEachOfTheirOwnModel) {
  add_study(1, "a", table_of_stiffnesses(50));
  add_results(1, {3, 0, 1, 98, 99, 40, 7, 2});
  EXPECT_EQ(rows_of_right_models(1), 8U);
  EXPECT_EQ(number("SELECT count(*) FROM models"), 5);
}

TEST_F(StoreModels, AModelIsOneRowInWhateverMessageOrStudyItComes) {
  add_study(1, "a", table_of_stiffnesses(11));
  add_study(2, "b", table_of_stiffnesses(101));  // of which eleven are the same
  add_results(1, {0, 2, 4, 6, 8, 10});
  add_results(2, {1, 20, 21, 40, 60, 200, 201});
  add_results(1, {1, 3, 12, 20});
  EXPECT_EQ(rows_of_right_models(1), 10U);
  EXPECT_EQ(rows_of_right_models(2), 7U);
  EXPECT_EQ(number("SELECT count(*) FROM models"), 8);
  EXPECT_EQ(number("SELECT count(DISTINCT definition) FROM models"), 8);
}

}  // namespace
}  // namespace oblique::server
