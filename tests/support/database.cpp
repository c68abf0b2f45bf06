#include "tests/support/database.h"

#include <sqlite3.h>

#include <functional>
#include <memory>
#include <stdexcept>

namespace oblique::test {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// Calls `take` for each row that the statement `sql` returns.
void for_each_row(const std::string& file, const std::string& sql,
                  const std::function<void(sqlite3_stmt*)>& take) {
  sqlite3* opened = nullptr;
  const int open_error = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  const std::unique_ptr<sqlite3, Close> database(opened);
  const auto check = [&](bool good) {
    if (!good) {
      throw std::runtime_error(file + ": " + sqlite3_errmsg(database.get()) + ": " + sql);
    }
  };
  check(open_error == SQLITE_OK);
  sqlite3_busy_timeout(database.get(), 10'000);
  sqlite3_stmt* prepared = nullptr;
  check(sqlite3_prepare_v2(database.get(), sql.c_str(), -1, &prepared, nullptr) == SQLITE_OK);
  const std::unique_ptr<sqlite3_stmt, Close> statement(prepared);
  int step = 0;
  while ((step = sqlite3_step(statement.get())) == SQLITE_ROW) {
    take(statement.get());
  }
  check(step == SQLITE_DONE);
}

}  // namespace

std::vector<double> Database::numbers(const std::string& sql) const {
  std::vector<double> values;
  for_each_row(file_, sql,
               [&](sqlite3_stmt* row) { values.push_back(sqlite3_column_double(row, 0)); });
  return values;
}

std::vector<std::string> Database::texts(const std::string& sql) const {
  std::vector<std::string> values;
  for_each_row(file_, sql, [&](sqlite3_stmt* row) {
    const void* text = sqlite3_column_blob(row, 0);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, 0));
    values.emplace_back(text == nullptr ? "" : static_cast<const char*>(text), size);
  });
  return values;
}

double Database::rows() const {
  try {
    return number("SELECT count(*) FROM results");
  } catch (const std::runtime_error&) {
    return 0.0;  // no tables yet
  }
}

}  // namespace oblique::test
