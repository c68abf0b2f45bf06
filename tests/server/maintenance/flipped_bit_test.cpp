// Flips random bits of a small database. Each flip is named by `check` or changes no answer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/backup.h"
#include "server/query/reader.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

/// Provides a database with solved, failed, left-out and reused points, and with free pages.
class FlippedBitTest : public StoreFixture {
 protected:
  FlippedBitTest() {
    const auto first = study_of(8);
    const auto filtered = filtered_table("mu < 0.4");  // keeps points 0 to 3
    const auto large = study_of(60, 4, "large");
    commit({first, worker(1), solved(first, numbers(0, 6)), failed(first, {6}),
            study_of(filtered, 2, "filtered"),
            AddResults{2, filtered, 1, "0.1", "avx2", 1, "now", {}, IntervalSet(4, 8)},
            study_of(8, 3, "again"),
            ReuseResults{3, table_of(8), 0, "0.1", std::make_shared<ReusedResults>()}, large,
            solved(large, numbers(0, 60))});
    commit({DeleteStudy{4}});
    while (store().clear_away(1000) != ClearedAway::kAll) {
    }
    close();
    std::ifstream file(path_, std::ios::binary);
    sound_.assign(std::istreambuf_iterator<char>(file), {});
    EXPECT_THAT(faults(), testing::IsEmpty());
  }

  /// Writes the file with one bit changed; nothing is beside it.
  void write_flipped(std::size_t bit) {
    for (const char* suffix : {"-wal", "-shm", "-journal"}) {
      std::filesystem::remove(path_ + suffix);
    }
    std::string bytes = sound_;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
    std::ofstream(path_, std::ios::binary) << bytes;
  }

  /// Returns all rows of tables and views, and the status of all studies.
  std::string answers() const {
    Reader reader(path_);
    std::string text;
    for (const char* from : {"runs", "results", "models", "workers", "peaks", "phases",
                             "stick_intervals", "reaction_peaks"}) {
      const protocol::Table rows = reader.query(fmt::format("SELECT * FROM {}", from), {});
      for (const protocol::Row& row : rows.rows) {
        for (const protocol::Value& value : row) {
          std::visit([&text](const auto& each) { text += written(each) + "|"; }, value);
        }
      }
    }
    for (const auto& study : reader.study_status()) {
      text += fmt::format("{} {} {} {} {} {} {} {}\n", study.study_id(), study.name(),
                          study.state(), study.points(), study.solved(), study.failed(),
                          study.left_out(), study.solver_version());
    }
    return text;
  }

  /// Calls `examine` for random flips. OBLIQUE_FLIPS=N in the environment tries N flips.
  void for_random_flips(int flips, const std::function<void(std::size_t bit)>& examine) {
    const char* const more = std::getenv("OBLIQUE_FLIPS");
    std::mt19937_64 random(more == nullptr ? 4711 : std::random_device()());
    for (int i = 0; i < (more == nullptr ? flips : std::atoi(more)); ++i) {
      const std::size_t bit = random() % (8 * sound_.size());
      write_flipped(bit);
      examine(bit);
    }
  }
  static std::string place(std::size_t bit) {
    return fmt::format("bit {} of byte {} in page {}", bit % 8, bit / 8 % 8192, bit / 8 / 8192 + 1);
  }

  std::string sound_;

 private:
  static std::string written(std::monostate) { return "NULL"; }
  static std::string written(const std::string& text) { return text; }
  template <class Number>
  static std::string written(Number number) {
    return fmt::format("{}", number);
  }
};

TEST_F(FlippedBitTest, EveryFlipIsNamedByTheCheckOrChangesNoAnswer) {
  const std::string expected = answers();
  int named = 0;
  for_random_flips(400, [&](std::size_t bit) {
    try {
      if (!diagnose(path_).faults.empty()) {
        ++named;
        return;
      }
    } catch (const StorageError&) {
      ++named;
      return;
    }
    try {
      EXPECT_EQ(answers(), expected) << place(bit);
    } catch (const std::exception& error) {
      ADD_FAILURE() << place(bit) << ": check is silent, but " << error.what();
    }
  });
  EXPECT_GT(named, 0);
}

TEST_F(FlippedBitTest, EveryReusedResultIsThatOfTheSameInputs) {
  const std::string outputs =
      "SELECT fn_peak_N, closure, mode, peaks, phases FROM runs WHERE study_id = {} AND point = {}";
  std::vector<std::string> expected;
  for (int point = 0; point < 6; ++point) {
    expected.push_back(rows(fmt::format(fmt::runtime(outputs), 1, point)).at(0));
  }
  std::uint64_t reused = 0;
  for_random_flips(100, [&](std::size_t bit) {
    const auto outcome = std::make_shared<ReusedResults>();
    try {
      commit({study_of(8, 5, "new"), ReuseResults{5, table_of(8), 0, "0.1", outcome}});
      reused += outcome->points.size();
      outcome->points.for_each([&](const Interval& range) {
        for (std::uint64_t point = range.begin; point < range.end; ++point) {
          EXPECT_EQ(rows(fmt::format(fmt::runtime(outputs), 5, point)).at(0), expected.at(point))
              << place(bit);
        }
      });
    } catch (const StorageError&) {
    }
    close();
  });
  EXPECT_GT(reused, 0U);
}

TEST_F(FlippedBitTest, ASalvagedFileIsSoundAndHasOnlyRowsOfTheFile) {
  const std::string copy = folder_.file("copy.db");
  const std::string all = "SELECT study_id, point, checksum FROM results";
  const auto expected = rows(all);
  for_random_flips(60, [&](std::size_t bit) {
    std::filesystem::remove(copy);
    try {
      const Salvaged saved = salvage(path_, copy);
      EXPECT_TRUE(!saved.losses.empty() || faults(copy).empty()) << place(bit);
      for (const std::string& row : rows(copy, all)) {
        EXPECT_THAT(expected, testing::Contains(row)) << place(bit);
      }
    } catch (const StorageError& error) {
      EXPECT_LT(bit / 8, 8192U) << error.what() << " " << place(bit);
    }
  });
}

}  // namespace
}  // namespace oblique::server
