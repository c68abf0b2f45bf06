#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/store/result_rows.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {

/// A database in a folder of its own, and what other programs read and write in it.
class StoreFixture : public testing::Test {
 protected:
  static AddStudy study_of(std::uint64_t points, std::uint64_t id = 1,
                           const std::string& name = "a") {
    return {id, name, table_of(points), "2024-01-01T00:00:00.000Z", {}};
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

  /// As another program does.
  void by_hand(const std::string& sql) const {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), sql);
  }
  /// The rows of a query, the values of each separated by '|'.
  std::vector<std::string> rows(const std::string& sql) const {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement statement(database.get(), sql);
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
  /// What is wrong with the file: damage, references to rows that are missing, wrong checksums.
  /// Rows of a study that is being deleted may refer to it.
  std::vector<std::string> faults() const {
    std::vector<std::string> found = rows(
        "SELECT * FROM pragma_foreign_key_check"
        " WHERE parent <> 'studies' OR NOT EXISTS (SELECT 1 FROM deletions)");
    for (const std::string& line : rows("PRAGMA integrity_check")) {
      if (line != "ok") {
        found.push_back(line);
      }
    }
    for (const auto& [table, checksum] :
         {std::pair("results", result_checksum_sql()), std::pair("models", model_checksum_sql()),
          std::pair("studies", std::string(kStudyChecksum))}) {
      for (const std::string& row :
           rows(fmt::format("SELECT * FROM {} WHERE checksum IS NOT {}", table, checksum))) {
        found.push_back(fmt::format("a row of {}: {}", table, row));
      }
    }
    return found;
  }
  /// Why the database cannot be opened.
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
