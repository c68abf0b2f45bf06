#include "server/store/result_row.h"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/row_checksum.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

TEST(ResultRow, ARowThatBreaksARuleOfTheTableIsAnErrorAndNotPassedOver) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("studies.db");
  { const Store store(path); }
  const DatabaseHandle database = open_database(path, SQLITE_OPEN_READWRITE);
  add_row_checksum(database.get());
  Statement insert(database.get(), insert_result_sql());
  RowContext context{1, 1, {0, 1.0, 0.5, 1.0}, 0, "", "", 1, "now"};
  for (const double H_m : {std::numeric_limits<double>::quiet_NaN(), 1.0}) {
    context.point.H_m = H_m;
    bind_result(insert, context, solved_point(0));
    if (std::isnan(H_m)) {
      EXPECT_THROW(insert.run(), StorageError) << "SQLite stores a NaN as NULL";
    } else {
      EXPECT_NO_THROW(insert.run());
    }
  }
  bind_result(insert, context, solved_point(0));
  EXPECT_NO_THROW(insert.run()) << "a point that has a row is passed over";
  Statement count(database.get(), "SELECT count(*) FROM results");
  ASSERT_TRUE(count.step());
  EXPECT_EQ(count.integer(0), 1);
}

}  // namespace
}  // namespace oblique::server
