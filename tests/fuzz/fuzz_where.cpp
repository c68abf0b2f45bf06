#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <unistd.h>

#include "server/asking/sql/sql_expression.h"
#include "server/reading/reader.h"
#include "server/store/store.h"
#include "worker/solver/model/errors.h"

namespace {

/// A reader of an empty database of ours, whose file is gone once it is open.
oblique::server::Reader& reader() {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("oblique-fuzz-" + std::to_string(getpid()) + ".db"))
                               .string();
  const oblique::server::Store store(path);
  static oblique::server::Reader opened(path);
  opened.query("SELECT 1", {});
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::filesystem::remove(path + suffix);
  }
  return opened;
}

/// Whether the command line takes `condition`.
bool is_taken(const std::string& condition) {
  try {
    oblique::server::check_sql_part("--where", condition, oblique::server::SqlPart::kCondition);
    return true;
  } catch (const oblique::solver::InputError&) {
    return false;
  }
}

/// A condition that is taken cannot reach beyond its brackets: whatever it says, there is no row.
void expect_no_row(oblique::server::Reader& database, const std::string& condition) {
  const auto reply =
      database.query("SELECT 1 FROM (SELECT 1 AS point, 0.4 AS mu, 0.9 AS e) WHERE (" + condition +
                         ") AND 0 LIMIT 5",
                     {10, 10'000, 50, 1'000'000});
  if (reply.rows_size() > 0) {
    std::abort();
  }
}

}  // namespace

/// A condition on results, as users write it behind --where: an answer or a QueryError, and never a
/// change of the database.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static oblique::server::Reader& database = reader();
  const std::string condition(reinterpret_cast<const char*>(data), size);
  try {
    if (is_taken(condition)) {
      expect_no_row(database, condition);
    }
    database.query("SELECT point FROM runs WHERE (" + condition + "\n) LIMIT 5",
                   {10, 10'000, 50, 1'000'000});
  } catch (const oblique::server::QueryError&) {
  }
  return 0;
}
