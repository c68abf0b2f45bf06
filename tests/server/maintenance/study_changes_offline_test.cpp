#include "server/maintenance/study_changes_offline.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "server/maintenance/check.h"
#include "server/maintenance/merge.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class OfflineStudyTest : public MaintenanceTest {
 protected:
  std::string refusal_of_renaming(std::uint64_t study, const std::string& name) {
    try {
      rename_study(path_, study, name);
    } catch (const StudyRefused& error) {
      return error.what();
    }
    return "it was renamed";
  }
};

TEST_F(OfflineStudyTest, AStudyGetsAnotherNameUnlessThatIsTakenOrNone) {
  store_->commit(std::vector<Change>{AddStudy{2, "b", table_, "2024-01-01T00:00:00.000Z"}});
  EXPECT_THROW(rename_study(path_, 1, "c"), StorageError) << "a server works on it";
  EXPECT_THROW(delete_study(path_, 1), StorageError);
  EXPECT_THROW(rename_study(copy_, 1, "c"), StorageError) << "there is no such file";
  EXPECT_FALSE(std::filesystem::exists(copy_));
  store_.reset();
  rename_study(path_, 1, "friction");
  EXPECT_EQ(Store(path_).studies().at(0).name, "friction");
  EXPECT_THAT(refusal_of_renaming(1, "b"), HasSubstr("there is a study called \"b\""));
  EXPECT_THAT(refusal_of_renaming(1, ""), HasSubstr("name"));
  EXPECT_THAT(refusal_of_renaming(7, "c"), HasSubstr("no longer"));
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(OfflineStudyTest, ADeletedStudyLeavesNothingBehind) {
  add_results(*store_, 5, 10, false);
  store_.reset();
  EXPECT_TRUE(delete_study(path_, 1));
  { const Store next(path_); }  // a start deletes what no row refers to
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  for (const char* table :
       {"studies", "models", "workers", "results", "completed_ranges", "deletions"}) {
    Statement count(database.get(), std::string("SELECT count(*) FROM ") + table);
    ASSERT_TRUE(count.step());
    EXPECT_EQ(count.integer(0), 0) << table;
  }
  EXPECT_THROW(delete_study(path_, 1), StudyRefused);
}

TEST_F(OfflineStudyTest, TheRecipeIsThatWhichWasStoredAlsoWhileAServerWorks) {
  EXPECT_EQ(stored_recipe(path_, 1).SerializeAsString(), table_->recipe().SerializeAsString());
  EXPECT_THROW(stored_recipe(path_, 2), StudyRefused);
}

TEST_F(OfflineStudyTest, ARecipeThatIsLongerThanAServerTakesIsNotParsed) {
  store_.reset();
  const std::string block = table_->recipe().SerializeAsString();  // a longer recipe goes on so
  std::string bytes;
  while (bytes.size() <= protocol::kMaxFrameBytes) {
    bytes += block;
  }
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute_with(database.get(), "UPDATE studies SET recipe = ?", Blob{bytes});
  }
  EXPECT_THROW(stored_recipe(path_, 1), StorageError);
  EXPECT_THAT(find_faults(path_), testing::Contains(HasSubstr("more than a recipe may have")));
}

TEST_F(OfflineStudyTest, RowsThatADeletionHasLeftAreNoFaultsAndAreNotMerged) {
  store_->commit(
      std::vector<Change>{AddStudy{2, "b", table_, "2024-01-01T00:00:00.000Z"}, DeleteStudy{1}});
  store_.reset();
  const Diagnosis found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks.at(0), HasSubstr("5 results of deleted studies are left"));
  Merger merger(copy_);
  const Merged merged = merger.merge(path_);
  EXPECT_EQ(merged.studies_added, 1U);
  EXPECT_EQ(merged.results_added, 0U);
}

}  // namespace
}  // namespace oblique::server
