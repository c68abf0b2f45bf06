// Files that another version of the program wrote.
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/maintenance/backup.h"
#include "server/maintenance/merge.h"
#include "server/maintenance/study_changes_offline.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

TEST_F(MaintenanceTest, AFileOfAnotherSchemaIsRefusedWithBothNumbersAndTheRemedy) {
  const std::vector<std::pair<std::string, std::function<void()>>> openers{
      {"server", [&] { const Store store(path_); }},
      {"backup", [&] { back_up(path_, copy_); }},
      {"salvage", [&] { salvage(path_, copy_); }},
      {"check", [&] { diagnose(path_); }},
      {"merge from it", [&] { Merger(copy_).merge(path_); }},
      {"merge into it", [&] { const Merger merger(path_); }},
      {"describe", [&] { stored_recipe(path_, 1); }},
      {"rename", [&] { rename_study(path_, 1, "b"); }}};
  const auto contents = [&] {
    std::ifstream file(path_, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  store_.reset();
  for (const auto& [schema, written_by] :
       {std::pair{kSchemaVersion - 1, "older"}, std::pair{kSchemaVersion + 1, "newer"}}) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
            fmt::format("PRAGMA user_version = {}; PRAGMA journal_mode = DELETE", schema));
    const std::string before = contents();
    for (const auto& [name, open] : openers) {
      EXPECT_THAT(open, testing::ThrowsMessage<StorageError>(fmt::format(
                            "{} has schema {}, and this version of oblique has schema {}: export "
                            "its results with the {} version that wrote it (oblique query STUDY "
                            "--db FILE --format csv), or solve its studies again into a new file",
                            path_, schema, kSchemaVersion, written_by)))
          << name;
      std::filesystem::remove(copy_);
    }
    EXPECT_EQ(contents(), before);
  }
}

}  // namespace
}  // namespace oblique::server
