#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/maintenance/check.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {

/// Ten points, mu from 0 to 1, of which a filter leaves out some.
inline std::shared_ptr<const protocol::PointTable> filtered_table(const std::string& where) {
  protocol::Recipe recipe = table_of(10)->recipe();
  recipe.mutable_blocks(0)->set_where(where);
  return std::make_shared<const protocol::PointTable>(recipe);
}

inline std::vector<std::string> find_faults(const std::string& path) {
  return diagnose(path).faults;
}

/// The first page of a table.
inline std::int64_t page_of(const std::string& path, const std::string& table) {
  const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  Statement root(database.get(), "SELECT rootpage FROM sqlite_schema WHERE name = ?");
  root.bind(1, std::string_view(table));
  EXPECT_TRUE(root.step()) << table;
  return root.integer(0);
}

constexpr std::int64_t kPageBytes = 8192;

/// Makes a page unreadable.
inline void overwrite_page(const std::string& path, std::int64_t page) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp((page - 1) * kPageBytes);
  file << std::string(kPageBytes, '\x5a');
}

/// A database with one study of ten points, five of them solved.
class MaintenanceTest : public testing::Test {
 protected:
  MaintenanceTest() { add_results(*store_, 0, 5, true); }

  void add_results(Store& store, std::uint64_t first, std::uint64_t end, bool with_study) {
    std::vector<Change> changes;
    if (with_study) {
      changes.emplace_back(AddStudy{1, "a", table_, "2024-01-01T00:00:00.000Z", {}});
      changes.emplace_back(AddWorker{1, "host", 1, "0.1", "avx2", "now"});
    }
    std::vector<protocol::PointResult> results;
    for (std::uint64_t point = first; point < end; ++point) {
      results.push_back(solved_point(point));
    }
    changes.emplace_back(
        AddResults{1, table_, 1, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", results});
    store.commit(changes);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::string copy_ = folder_.file("copy.db");
  std::shared_ptr<const protocol::PointTable> table_ = table_of(10);
  std::optional<Store> store_{path_};
};

}  // namespace oblique::server
