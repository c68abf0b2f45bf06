#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <unistd.h>

#include "server/database/database_file.h"
#include "server/query/plan.h"
#include "server/query/reader.h"
#include "server/query/sql_text.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "worker/solver/model/errors.h"

namespace {

using oblique::server::Change;

/// A database that contains a study without rows. Its file is deleted after it is opened.
struct Opened {
  oblique::server::Reader reader;
  oblique::server::DatabaseHandle database;
};

Opened& opened() {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("oblique-fuzz-" + std::to_string(getpid()) + ".db"))
                               .string();
  oblique::server::Store store(path);
  store.commit(std::vector<Change>{oblique::server::AddStudy{1, "a", oblique::server::table_of(100),
                                                             "2024-01-01T00:00:00.000Z"}});
  static Opened files{oblique::server::Reader(path), oblique::server::open_for_reading(path)};
  files.reader.query("SELECT 1", {});
  oblique::server::restrict_to_reading(files.database.get());
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::filesystem::remove(path + suffix);
  }
  return files;
}

/// Returns whether the command line accepts `condition`.
bool is_taken(const std::string& condition) {
  try {
    oblique::server::check_sql_part("--where", condition);
    return true;
  } catch (const oblique::solver::InputError&) {
    return false;
  }
}

/// Checks that an accepted condition cannot break out of its brackets: `(condition) AND 0` must
/// select no row.
void expect_no_row(oblique::server::Reader& database, const std::string& condition) {
  const auto reply =
      database.query("SELECT 1 FROM (SELECT 1 AS point, 0.4 AS mu, 0.9 AS e) WHERE (" + condition +
                         ") AND 0 LIMIT 5",
                     {10'000, 50, 1'000'000});
  if (!reply.rows.empty()) {
    std::abort();
  }
}

/// Uses the text as one part of a query. The length of the text selects the part. Planning the
/// query must succeed or throw an InputError.
void plan_query(sqlite3* database, const std::string& text) {
  constexpr std::size_t kParts = 4;
  oblique::protocol::StudyQuery question;
  question.set_study("a");
  question.set_limit(5);
  switch (text.size() % kParts) {
    case 0:
      question.set_where(text);
      break;
    case 1:
      question.add_select(text);
      break;
    case 2:
      question.set_order(text);
      break;
    default:
      question.set_group(text);
      break;
  }
  try {
    static_cast<void>(oblique::server::plan(database, question));
  } catch (const oblique::solver::InputError&) {
  }
}

}  // namespace

/// Checks that a condition gives an answer or a QueryError and never changes the database.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Opened& files = opened();
  const std::string condition(reinterpret_cast<const char*>(data), size);
  plan_query(files.database.get(), condition);
  try {
    if (is_taken(condition)) {
      expect_no_row(files.reader, condition);
    }
    files.reader.query("SELECT point FROM runs WHERE (" + condition + "\n) LIMIT 5",
                       {10'000, 50, 1'000'000});
  } catch (const oblique::server::QueryError&) {
  }
  return 0;
}
