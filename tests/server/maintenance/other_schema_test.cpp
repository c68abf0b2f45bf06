// Files that another version of the program wrote.
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/maintenance/merge.h"
#include "server/maintenance/study_changes_offline.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

class OtherSchema : public MaintenanceTest,
                    public testing::WithParamInterface<std::pair<int, std::string>> {
 protected:
  OtherSchema() {
    store_.reset();
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
            "PRAGMA user_version = " + std::to_string(GetParam().first) +
                "; PRAGMA journal_mode = DELETE");
  }

  std::string contents() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

TEST_P(OtherSchema, IsRefusedByWhateverOpensItWithBothNumbersAndTheRemedy) {
  const auto& [schema, written_by] = GetParam();
  const auto before = contents();
  const std::vector<std::pair<std::string, std::function<void()>>> openers{
      {"server", [&] { const Store store(path_); }},
      {"backup", [&] { back_up(path_, copy_); }},
      {"salvage", [&] { salvage(path_, copy_); }},
      {"check", [&] { diagnose(path_); }},
      {"merge from it", [&] { Merger(copy_).merge(path_, {}, [](auto, auto) {}); }},
      {"merge into it", [&] { const Merger merger(path_); }},
      {"describe", [&] { stored_recipe(path_, 1); }},
      {"rename", [&] { rename_study(path_, 1, "b"); }}};
  for (const auto& [name, open] : openers) {
    EXPECT_THAT(open,
                testing::ThrowsMessage<StorageError>(
                    path_ + " has schema " + std::to_string(schema) +
                    ", and this version of oblique has schema " + std::to_string(kSchemaVersion) +
                    ": export its results with the " + written_by +
                    " version that wrote it (oblique query STUDY --db FILE --format csv), "
                    "or solve its studies again into a new file"))
        << name;
  }
  EXPECT_EQ(contents(), before);
}

INSTANTIATE_TEST_SUITE_P(Files, OtherSchema,
                         testing::Values(std::pair{kSchemaVersion - 1, "older"},
                                         std::pair{kSchemaVersion + 1, "newer"}));

}  // namespace
}  // namespace oblique::server
