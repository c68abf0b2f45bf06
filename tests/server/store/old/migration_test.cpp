// A database of schema 7 that is brought to the present one on a disk that fills, by a program that
// is killed, and with what people added to it.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/care/diagnosis.h"
#include "server/store/store.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// ---- A disk that fails from its n-th write on; in a process of its own, for SQLite keeps it
// -------

enum class Fault { kKilled, kFull };

int writes_left = 0;
Fault kind_of_fault = Fault::kKilled;
bool all_fail = false;
std::atomic<int>* writes_made = nullptr;  // shared with the parent

ssize_t write_or_fail(int file, const void* bytes, std::size_t count, off_t at) {
  ++*writes_made;
  if (--writes_left == 0) {
    if (kind_of_fault == Fault::kKilled) {
      (void)!::pwrite(file, bytes, count / 2, at);
      ::kill(::getpid(), SIGKILL);
    }
    all_fail = true;
  }
  if (all_fail) {
    errno = ENOSPC;
    return -1;
  }
  return ::pwrite(file, bytes, count, at);
}

class MigrationTest : public testing::Test {
 protected:
  MigrationTest() {
    void* shared = ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    writes_made = new (shared) std::atomic<int>(0);
  }
  ~MigrationTest() override { ::munmap(writes_made, sizeof(std::atomic<int>)); }

  std::string old_file(const std::string& name) const {
    const std::string path = folder_.file(name);
    std::filesystem::copy_file(OBLIQUE_OLD_SCHEMAS "/made_by_schema_7.sqlite", path);
    return path;
  }

  /// What the kernel says of a process that opens the database, whose write number `write` (0:
  /// none) fails; what it says of its failure is in `words_`.
  int open_with_fault(const std::string& path, Fault kind, int write) const {
    *writes_made = 0;
    const pid_t child = ::fork();
    if (child == 0) {
      kind_of_fault = kind;
      writes_left = write;
      sqlite3_vfs* vfs = sqlite3_vfs_find(nullptr);
      for (const char* name : {"pwrite", "pwrite64"}) {
        vfs->xSetSystemCall(vfs, name, reinterpret_cast<sqlite3_syscall_ptr>(&write_or_fail));
      }
      try {
        const Store store(path);
      } catch (const StorageError& error) {
        std::ofstream(words_) << error.what();
        _exit(EXIT_FAILURE);
      }
      _exit(EXIT_SUCCESS);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  static void remove_files(const std::string& path) {
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::filesystem::remove(path + suffix);
    }
  }

  std::string words() const {
    std::ifstream file(words_);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static std::vector<std::string> texts(const std::string& path, const std::string& sql) {
    const DatabaseHandle database = open_database(path, SQLITE_OPEN_READWRITE);
    Statement statement(database.get(), sql);
    std::vector<std::string> found;
    while (statement.step()) {
      found.push_back(statement.text(0));
    }
    return found;
  }

  /// Whichever schema it has: each row by what no migration changes, and no page that is damaged.
  static std::vector<std::string> contents(const std::string& path) {
    EXPECT_THAT(texts(path, "PRAGMA integrity_check"), ElementsAre("ok"));
    return texts(path,
                 "SELECT study || ' ' || point || ' ' || H || ' ' || mu || ' ' || e || ' ' ||"
                 " status || ' ' || coalesce(mode, '') || ' ' || attempt || ' ' || solved_at"
                 " FROM runs ORDER BY study_id, point");
  }

  /// SQL on a file of schema 7; gives what is said while it is brought over.
  std::vector<std::string> said_of(const std::string& path, const std::string& additions) const {
    execute(open_database(path, SQLITE_OPEN_READWRITE).get(), additions);
    std::vector<std::string> said;
    const Store store(path, [&](const std::string& sentence) { said.push_back(sentence); });
    return said;
  }

  test::TemporaryFolder folder_;
  std::string words_ = folder_.file("words.txt");
};

TEST_F(MigrationTest, KilledAtAnyWriteOrInTheMiddleOfItLeavesEveryRowAndTheNextStartEndsIt) {
  const std::string before = old_file("before.db");
  const auto rows = contents(before);
  ASSERT_EQ(rows.size(), 22U);
  EXPECT_EQ(open_with_fault(old_file("whole.db"), Fault::kKilled, 0), 0);
  const int writes = *writes_made;
  ASSERT_GT(writes, 50);
  for (int write = 1; write <= writes; write += write < 5 ? 1 : writes / 24) {
    const std::string path = old_file("killed.db");
    const int status = open_with_fault(path, Fault::kKilled, write);
    ASSERT_TRUE(WIFSIGNALED(status)) << "at write " << write << " of " << writes;
    EXPECT_EQ(contents(path), rows) << "killed at write " << write << " of " << writes;
    { const Store store(path); }
    EXPECT_EQ(contents(path), rows) << "opened again after write " << write;
    EXPECT_THAT(find_faults(path), IsEmpty()) << write;
    EXPECT_THAT(texts(path, "PRAGMA user_version"), ElementsAre("8"));
    EXPECT_THAT(texts(path, "PRAGMA auto_vacuum"), ElementsAre("2"));
    remove_files(path);
  }
}

TEST_F(MigrationTest, OnAFullDiskSaysWhichFileNeedsHowMuchAndLeavesEveryRow) {
  const std::string before = old_file("before.db");
  const auto rows = contents(before);
  EXPECT_EQ(open_with_fault(old_file("whole.db"), Fault::kFull, 0), 0);
  const int writes = *writes_made;
  int refused = 0;
  for (int write = 1; write <= writes; write += writes / 16) {
    const std::string path = old_file("full.db");
    const int status = open_with_fault(path, Fault::kFull, write);
    ASSERT_TRUE(WIFEXITED(status)) << write;
    if (WEXITSTATUS(status) != EXIT_SUCCESS && texts(path, "PRAGMA user_version").at(0) == "7") {
      EXPECT_THAT(words(), HasSubstr(path)) << write;
      // With no room even for the log's index no schema can be read.
      if (words().find("cannot read the database") != std::string::npos) {
        remove_files(path);
        continue;
      }
      ++refused;
      EXPECT_THAT(words(), AllOf(HasSubstr(path + " cannot be brought from schema 7 to 8"),
                                 HasSubstr("stays as it is"), HasSubstr("MB more on its disk"),
                                 HasSubstr("MB are free: make room, and start again")))
          << write;
      EXPECT_EQ(texts(path, "SELECT group_concat(checksum) FROM results"),
                texts(before, "SELECT group_concat(checksum) FROM results"));
    }
    EXPECT_EQ(contents(path), rows) << write;
    { const Store store(path); }
    EXPECT_EQ(contents(path), rows) << write;
    EXPECT_THAT(find_faults(path), IsEmpty()) << write;
    remove_files(path);
  }
  EXPECT_GT(refused, 3);
}

TEST_F(MigrationTest, KeepsTablesAndViewsThatPeopleMadeAndIndicesOfColumnsThatAreStillThere) {
  const std::string path = old_file("added.db");
  const auto said =
      said_of(path,
              "CREATE TABLE notes (study_id, point, note);"
              "INSERT INTO notes VALUES (1, 2, 'odd');"
              "CREATE INDEX notes_by_point ON notes (point);"
              "CREATE VIEW odd AS SELECT r.H, n.note FROM results AS r JOIN notes AS n"
              " USING (study_id, point);"
              "CREATE INDEX by_drop ON results (H, mu DESC);");
  EXPECT_THAT(texts(path, "SELECT note FROM odd"), ElementsAre("odd"));
  EXPECT_THAT(texts(path, "SELECT tbl_name FROM sqlite_schema WHERE name = 'by_drop'"),
              ElementsAre("packed_results"));
  EXPECT_THAT(texts(path,
                    "SELECT name || \"desc\" FROM pragma_index_xinfo('by_drop') WHERE key"
                    " ORDER BY seqno LIMIT 2"),
              ElementsAre("H0", "mu1"));
  EXPECT_THAT(said, testing::Not(Contains(HasSubstr("added"))));
  EXPECT_THAT(find_faults(path), IsEmpty());
}

TEST_F(MigrationTest, LeavesOutARowWithANumberThatNoUnitHolds) {
  const std::string path = old_file("edited.db");
  const auto said = said_of(
      path,
      "UPDATE results SET peaks = '[[1e-5,1e308,0,1]]', checksum = NULL"
      " WHERE study_id = 1 AND point = 1;"
      "UPDATE results SET fn_peak_N = 9e999, checksum = NULL WHERE study_id = 1 AND point = 2;"
      "UPDATE results SET duration_s = 1e300, checksum = NULL WHERE study_id = 1 AND point = 3;");
  EXPECT_THAT(said, Contains(HasSubstr("3 results were not as they were stored: they are left "
                                       "out, and their points are solved again")));
  EXPECT_THAT(texts(path, "SELECT count(*) FROM runs WHERE study_id = 1 AND point IN (1, 2, 3)"),
              ElementsAre("0"));
  EXPECT_THAT(texts(path,
                    "SELECT sum(json_valid(peaks) AND json_valid(phases)) FROM runs"
                    " WHERE status = 'solved'"),
              texts(path, "SELECT count(*) FROM runs WHERE status = 'solved'"));
}

TEST_F(MigrationTest, KeepsAddedColumnsInATableAndNamesThem) {
  const std::string path = old_file("added.db");
  const auto said = said_of(path,
                            "ALTER TABLE results ADD COLUMN remark TEXT;"
                            "ALTER TABLE results ADD COLUMN \"my rank\" INTEGER DEFAULT NULL;"
                            "UPDATE results SET remark = 'look' WHERE study_id = 1 AND point = 3;"
                            "UPDATE results SET \"my rank\" = 7 WHERE study_id = 1 AND point = 4;");
  EXPECT_THAT(said, Contains(HasSubstr("columns that were added to results (remark, my rank) stand "
                                       "now in the table added_columns")));
  EXPECT_THAT(texts(path,
                    "SELECT point || coalesce(remark, '-') || coalesce(\"my rank\", '-')"
                    " FROM runs JOIN added_columns USING (study_id, point) ORDER BY point"),
              ElementsAre("3look-", "4-7"));
  EXPECT_THAT(find_faults(path), IsEmpty());
}

TEST_F(MigrationTest, NamesWhatHasANameThatItWantsAndLeavesTheFileAsItIs) {
  const std::string additions =
      "ALTER TABLE results ADD COLUMN remark TEXT; UPDATE results SET remark = 'look';"
      "CREATE INDEX of_few ON results (H) WHERE mu > 1;";
  int number = 0;
  for (const std::string name :
       {"added_columns", "added_before_8", "packed_results", "texts", "deletions", "taken_points",
        "settled_points", "origins", "results_7", "runs", "peaks"}) {
    for (const std::string kind : {"TABLE", "VIEW"}) {
      if (kind == "VIEW" && (name == "runs" || name == "peaks")) {
        continue;  // made anew, as ever
      }
      const std::string path = old_file(std::to_string(++number) + ".db");
      const std::string mine = kind == "TABLE" ? " (a, b, c)" : " AS SELECT 1 AS a, 2 AS b, 3 AS c";
      execute(open_database(path, SQLITE_OPEN_READWRITE).get(),
              additions + "DROP VIEW IF EXISTS runs; DROP VIEW IF EXISTS peaks; CREATE " + kind +
                  " " + name + mine);
      const auto before = texts(path, "SELECT name FROM sqlite_schema ORDER BY name");
      try {
        const Store store(path);
        FAIL() << name;
      } catch (const StorageError& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr(name + " has a name that is needed"),
                                        HasSubstr(kind == "TABLE" ? "ALTER TABLE" : "DROP view")));
      }
      EXPECT_EQ(texts(path, "SELECT name FROM sqlite_schema ORDER BY name"), before) << name;
      EXPECT_THAT(texts(path, "PRAGMA user_version"), ElementsAre("7"));
    }
  }
}

TEST_F(MigrationTest, ATableMayBeCalledAsATriggerOfOursIs) {
  const std::string path = old_file("named.db");
  (void)said_of(path, "CREATE TABLE delete_results (x);");
  EXPECT_THAT(find_faults(path), IsEmpty());
}

TEST_F(MigrationTest, NamesATableWhoseForeignKeyNeedsTheTableResults) {
  const std::string path = old_file("notes.db");
  EXPECT_THAT(said_of(path,
                      "CREATE TABLE notes (study_id, point,"
                      " FOREIGN KEY (study_id, point) REFERENCES results (study_id, point));"
                      "INSERT INTO notes VALUES (1, 2);"),
              Contains(HasSubstr("the table notes has a foreign key to results")));
  EXPECT_THAT(texts(path, "SELECT count(*) FROM notes"), ElementsAre("1"));
  EXPECT_THAT(find_faults(path), IsEmpty());
}

TEST_F(MigrationTest, NamesWhatCannotBeKeptAndKeepsTheSqlOfIt) {
  const std::string path = old_file("added.db");
  const auto said = said_of(path,
                            "CREATE INDEX by_peak ON results (fn_peak_N);"
                            "CREATE INDEX of_few ON results (H) WHERE mu > 1;"
                            "CREATE UNIQUE INDEX by_sum ON results (study_id, point, H + mu);"
                            "CREATE VIEW lost AS SELECT rowid, no_column FROM results;");
  EXPECT_THAT(said, AllOf(Contains(HasSubstr("the index by_peak on results is gone")),
                          Contains(HasSubstr("the index of_few on results is gone")),
                          Contains(HasSubstr("the index by_sum on results is gone")),
                          Contains(HasSubstr("the view lost is kept, but cannot be read"))));
  EXPECT_THAT(texts(path, "SELECT kind || ' ' || name FROM added_before_8 ORDER BY name"),
              ElementsAre("index by_peak", "index by_sum", "index of_few"));
  EXPECT_THAT(texts(path, "SELECT sql FROM added_before_8 WHERE name = 'by_peak'"),
              ElementsAre("CREATE INDEX by_peak ON results (fn_peak_N)"));
  EXPECT_THAT(texts(path, "SELECT count(*) FROM runs"), ElementsAre("22"));
  EXPECT_THAT(find_faults(path), IsEmpty());
}

}  // namespace
}  // namespace oblique::server
