#pragma once

#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/maintenance/check.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {

using Table = std::shared_ptr<const protocol::PointTable>;

inline Table table(const protocol::Recipe& recipe) {
  return std::make_shared<const protocol::PointTable>(recipe);
}

/// Returns ten points with mu from 0 to 1 and the filter `where`.
inline Table filtered_table(const std::string& where) {
  protocol::Recipe recipe = table_of(10)->recipe();
  recipe.mutable_blocks(0)->set_where(where);
  return table(recipe);
}

/// Returns the ten points of `table_of(10)` twice.
inline Table grown_table() {
  protocol::Recipe recipe = table_of(10)->recipe();
  *recipe.add_blocks() = recipe.blocks(0);
  return table(recipe);
}

/// Returns the numbers from `first` to `end` - 1.
inline std::vector<std::uint64_t> numbers(std::uint64_t first, std::uint64_t end) {
  std::vector<std::uint64_t> found(end - first);
  std::iota(found.begin(), found.end(), first);
  return found;
}

/// Provides a database in its own folder. Tests can also access the file as another program would.
class StoreFixture : public testing::Test {
 protected:
  static AddStudy study_of(Table points, std::uint64_t id = 1, const std::string& name = "a") {
    return {id, name, std::move(points), "2024-01-01T00:00:00.000Z", {}};
  }
  static AddStudy study_of(std::uint64_t points, std::uint64_t id = 1,
                           const std::string& name = "a") {
    return study_of(table_of(points), id, name);
  }
  static AddWorker worker(std::uint64_t id, const std::string& version = "0.1") {
    return {id, "host", 2, version, "avx2", "2024-01-01T00:00:00.000Z"};
  }
  static AddResults results_of(const AddStudy& study, std::vector<protocol::PointResult> results,
                               std::uint64_t worker_id = 1) {
    return {study.study_id,
            study.table.get(),
            worker_id,
            "0.1",
            "avx2",
            1,
            "2024-01-01T00:00:01.000Z",
            std::move(results)};
  }
  static AddResults solved(const AddStudy& study, const std::vector<std::uint64_t>& points,
                           std::uint64_t worker_id = 1) {
    AddResults change = results_of(study, {}, worker_id);
    for (const std::uint64_t point : points) {
      change.results.push_back(solved_point(point));
    }
    return change;
  }
  static AddResults failed(const AddStudy& study, const std::vector<std::uint64_t>& points) {
    AddResults change = results_of(study, {});
    for (const std::uint64_t point : points) {
      change.results.push_back(protocol::failed_point(point, "it did not end"));
    }
    return change;
  }

  Store& store() {
    if (!store_) {
      store_.emplace(path_);
    }
    return *store_;
  }
  void commit(const std::vector<Change>& changes) { store().commit(changes); }
  void close() { store_.reset(); }

  /// Runs SQL on a separate connection, as another program would.
  void execute_sql(const std::string& sql) const { execute_sql(path_, sql); }
  static void execute_sql(const std::string& path, const std::string& sql) {
    execute(open_database(path, SQLITE_OPEN_READWRITE).get(), sql);
  }
  /// Returns the rows of a query. The values of a row are separated by '|'.
  std::vector<std::string> rows(const std::string& sql) const { return rows(path_, sql); }
  static std::vector<std::string> rows(const std::string& path, const std::string& sql) {
    return rows(open_database(path, SQLITE_OPEN_READONLY).get(), sql);
  }
  static std::vector<std::string> rows(sqlite3* database, const std::string& sql) {
    Statement statement(database, sql);
    std::vector<std::string> found;
    while (statement.step()) {
      std::string& row = found.emplace_back();
      for (int column = 0; column < statement.columns(); ++column) {
        row += (column == 0 ? "" : "|") + statement.text(column);
      }
    }
    return found;
  }
  std::int64_t number(const std::string& sql) const { return std::stoll(rows(sql).at(0)); }
  /// Returns the faults that a check of the whole file finds.
  std::vector<std::string> faults() const { return faults(path_); }
  static std::vector<std::string> faults(const std::string& path) { return diagnose(path).faults; }
  /// Returns the error message of opening the database.
  std::string refusal() const {
    try {
      Store opened(path_);
      (void)opened.last_study_id();
      (void)opened.studies();
    } catch (const StorageError& error) {
      return error.what();
    }
    return "it opened";
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");

 private:
  std::optional<Store> store_;
};

}  // namespace oblique::server
