#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/care/merge.h"
#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {

using Table = std::shared_ptr<const protocol::PointTable>;

/// Results of one study in one database.
struct Part {
  std::string study = "a";
  Table table = table_of(10);
  std::uint64_t first = 0;
  std::uint64_t end = 0;
  std::string solver_version = "0.1";
  std::string worker = "host";
  std::vector<std::uint64_t> failed{};
  StudyTerms terms{};
  double closure = 0.0;  ///< added to that of each result
};

/// Databases that are made, and merged into the one called `all`.
class MergeTest : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name + ".db"); }

  /// A database with these studies and results; some may be there already.
  void store(const std::string& name, const std::vector<Part>& parts) const {
    Store store(file(name));
    for (const Part& part : parts) {
      commit(store, part);
    }
  }

  static void commit(Store& store, const Part& part) {
    const auto studies = store.studies();
    const auto known = std::find_if(studies.begin(), studies.end(),
                                    [&](const auto& study) { return study.name == part.study; });
    const bool is_new = known == studies.end();
    const std::uint64_t study = is_new ? store.last_study_id() + 1 : known->study_id;
    const std::uint64_t worker = store.last_worker_id() + 1;
    std::vector<Change> changes;
    if (is_new) {
      changes.emplace_back(
          AddStudy{study, part.study, part.table, "2024-01-01T00:00:00.000Z", part.terms});
    }
    changes.emplace_back(AddWorker{worker, part.worker, 1, part.solver_version, "avx2", "then"});
    AddResults results{study, part.table, worker, part.solver_version, "avx2", 1, "now", {}};
    for (std::uint64_t point = part.first; point < part.end; ++point) {
      const bool failed =
          std::find(part.failed.begin(), part.failed.end(), point) != part.failed.end();
      protocol::PointResult result =
          failed ? protocol::failed_point(point, "why") : solved_point(point);
      if (!failed && part.closure != 0.0) {
        solver::CaseResult other = protocol::from_message(result);
        other.energy.closure += part.closure;
        result = protocol::to_message(point, other);
      }
      results.results.push_back(std::move(result));
    }
    changes.emplace_back(std::move(results));
    store.commit(changes);
  }

  Merged merge(const std::string& source, const MergeSettings& settings = {}) const {
    return Merger(file("all")).merge(file(source), settings, [](auto, auto) {});
  }

  std::string refusal(const std::string& source, const MergeSettings& settings = {}) const {
    try {
      merge(source, settings);
    } catch (const MergeRefused& error) {
      return error.what();
    }
    return "it was merged";
  }

  std::vector<std::string> texts(const std::string& name, const std::string& sql) const {
    const DatabaseHandle database = open_database(file(name), SQLITE_OPEN_READWRITE);
    Statement statement(database.get(), sql);
    std::vector<std::string> found;
    while (statement.step()) {
      found.push_back(statement.text(0));
    }
    return found;
  }
  std::string text(const std::string& name, const std::string& sql) const {
    return texts(name, sql).at(0);
  }

  test::TemporaryFolder folder_;
};

}  // namespace oblique::server
