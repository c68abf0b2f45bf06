#include "server/store/rows/packed_row.h"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/row_checksum.h"
#include "server/maintenance/check.h"
#include "server/store/rows/row_columns.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

TEST(PackedRow, ThatBreaksARuleOfTheTableIsAnErrorAndNotPassedOver) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("studies.db");
  { const Store store(path); }
  const DatabaseHandle database = open_database(path, SQLITE_OPEN_READWRITE);
  add_row_checksum(database.get());
  TextNumbers texts(database.get());
  RowInsert insert(database.get());
  PackedRow row;
  RowContext context{1, 1, 1e-5, {0, 1.0, 0.5, 1.0}, 0, 0, 1, "now"};
  const auto outputs = protocol::from_message(solved_point(0));
  for (const double H_m : {std::numeric_limits<double>::quiet_NaN(), 1.0}) {
    context.point.H_m = H_m;
    row.pack(context, &outputs, "", texts);
    if (std::isnan(H_m)) {
      EXPECT_THROW(insert.run(row), StorageError) << "SQLite stores a NaN as NULL";
    } else {
      EXPECT_TRUE(insert.run(row));
    }
  }
  EXPECT_FALSE(insert.run(row)) << "a point that has a row is passed over";
  Statement count(database.get(), "SELECT count(*) FROM results");
  ASSERT_TRUE(count.step());
  EXPECT_EQ(count.integer(0), 1);
}

TEST(PackedRow, HasNullForWhatAResultLacksAndNoCheckMissesIt) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("studies.db");
  const auto table = table_of(2);
  auto lacking = protocol::from_message(solved_point(1));
  lacking.margin.reset();
  lacking.margin_event.reset();
  {
    Store store(path);
    store.commit(std::vector<Change>{
        AddStudy{1, "a", table, "then"}, AddWorker{1, "host", 2, "0.1", "avx2", "then"},
        AddResults{1,
                   table,
                   1,
                   "0.1",
                   "avx2",
                   1,
                   "now",
                   {solved_point(0), protocol::to_message(1, lacking)}}});
  }
  const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  Statement rows(database.get(),
                 "SELECT margin IS NULL, margin_event IS NULL, closure > 0 FROM runs"
                 " ORDER BY point");
  for (const std::int64_t lacks : {0, 1}) {
    ASSERT_TRUE(rows.step());
    EXPECT_EQ(rows.integer(0), lacks);
    EXPECT_EQ(rows.integer(1), lacks);
    EXPECT_EQ(rows.integer(2), 1);
  }
  EXPECT_THAT(find_faults(path), testing::IsEmpty());
}

}  // namespace
}  // namespace oblique::server
