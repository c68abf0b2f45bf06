// Lists that our functions make are, byte for byte, those that the views of the file make.
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/lists/quick_views.h"
#include "server/asking/lists/unpacking.h"
#include "server/asking/plan.h"
#include "server/database/open_for_reading.h"
#include "server/reading/query_rules.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

constexpr int kRows = 200;
constexpr std::array<const char*, 5> kPacked{"peaks", "ft_peaks", "phases", "stick_intervals",
                                             "reaction_peaks"};

/// Whole numbers of all sizes, negative ones too, the same on every machine.
class DrawnLists {
 public:
  std::string list(int numbers) {
    std::string text;
    for (int i = 0; i < numbers; ++i) {
      text += fmt::format("{}{}", i == 0 ? "" : ",", number());
    }
    return "[" + text + "]";
  }
  std::int64_t number() {
    constexpr int kMostDigits = 16;  // one more than a double keeps
    std::int64_t limit = 1;
    for (int digits = below(kMostDigits + 1); digits > 0; --digits) {
      limit *= 10;
    }
    const auto drawn = static_cast<std::int64_t>(engine_() % static_cast<std::uint64_t>(limit));
    return below(4) == 0 ? -drawn : drawn;
  }
  int below(int limit) { return static_cast<int>(engine_() % static_cast<unsigned>(limit)); }

 private:
  std::mt19937_64 engine_{14};
};

class QuickLists : public testing::Test {
 protected:
  QuickLists() {
    Store store(path_);
    const auto table = table_of(kRows);
    AddResults results{1, table, 0, "", "", 1, "now", {}};
    for (std::uint64_t point = 0; point < kRows; ++point) {
      results.results.push_back(solved_point(point));
    }
    const std::vector<Change> changes{AddStudy{1, "a", table, "2024-01-01T00:00:00.000Z"},
                                      std::move(results)};
    store.commit(changes);
  }

  /// What is stored of a point from now on, as SQL.
  void set(int point, const std::string& column, const std::string& value) {
    if (editor_ == nullptr) {
      editor_ = open_database(path_, SQLITE_OPEN_READWRITE);
    }
    execute(editor_.get(), fmt::format("UPDATE packed_results SET {} = {} WHERE point = {}", column,
                                       value, point));
  }
  void open() {
    database_ = open_for_reading(path_).database;
    restrict_to_reading(database_.get());
  }
  /// What a statement gives: values with their types, or how it fails.
  std::string answer(const std::string& sql) {
    std::string text;
    try {
      Statement statement(database_.get(), sql);
      while (statement.step()) {
        for (int i = 0; i < statement.columns(); ++i) {
          text += fmt::format("{}:{}\n", statement.type(i), statement.text(i));
        }
      }
    } catch (const StorageError& error) {
      const std::string says = error.what();
      text += says.substr(says.rfind(':') + 1);
    }
    return text;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  DatabaseHandle editor_;
  DatabaseHandle database_;
};

TEST_F(QuickLists, AreThoseOfTheViews) {
  DrawnLists drawn;
  for (int point = 0; point < kRows; ++point) {
    for (const char* column : kPacked) {
      if (drawn.below(6) > 0) {
        const int most = column == std::string("peaks") ? 3 : 2;
        set(point, column,
            drawn.below(8) == 0 ? "NULL" : fmt::format("'{}'", drawn.list(most * drawn.below(5))));
      }
    }
    set(point, "duration", drawn.below(9) == 0 ? "0.5" : fmt::format("{}", drawn.number()));
  }
  open();
  EXPECT_NE(answer("SELECT peaks FROM temp.runs"), "") << "there are quick views";
  EXPECT_EQ(answer("SELECT * FROM temp.runs"), answer("SELECT * FROM main.runs"));
  EXPECT_EQ(answer("SELECT * FROM temp.results"), answer("SELECT * FROM main.results"));
  for (const ListColumn& list : lists_of_queries()) {
    const std::string ours = answer(fmt::format("SELECT {} FROM temp.runs AS runs", list.sql));
    std::string slow = list.sql;
    if (const auto at = slow.find("list_member("); at != std::string::npos) {
      slow.replace(at, slow.find(')', at) + 1 - at, "NULL");
    }
    const auto theirs = answer(fmt::format("SELECT {} FROM main.runs AS runs", slow));
    EXPECT_EQ(ours, theirs) << list.name;
  }
}

TEST_F(QuickLists, AreJsonToOtherFunctions) {
  open();
  for (const char* column : kPacked) {
    const std::string asked = fmt::format("SELECT json_array({}) FROM ", column);
    EXPECT_EQ(answer(asked + "temp.runs"), answer(asked + "main.runs")) << column;
  }
}

TEST_F(QuickLists, OfWhatIsNotPackedAsUsualAreWhatTheViewsMakeOfIt) {
  const std::vector<std::string> hostile{"[",
                                         "]",
                                         "",
                                         "[1,]",
                                         "[,1]",
                                         "[1 ,2,3]",
                                         "[01,2,3]",
                                         "[-0,-0,-0]",
                                         "{}",
                                         "[[1,2,3]]",
                                         "[1,2,3]x",
                                         "[1.5,2e3,-3.25]",
                                         "[1,2]",
                                         "[1,2,3,4]",
                                         "null",
                                         "[null,1,2]",
                                         "[\"a\",\"b\",\"c\"]",
                                         "[true,false,true]",
                                         "[9223372036854775807,1,1]",
                                         "[99999999999999999999,1,2]",
                                         "[1,2,3" + std::string(100, ' ') + "]",
                                         "[+1,2,3]",
                                         "[0x10,1,2]",
                                         "[1;2;3]",
                                         "[1,2,3],[4,5,6]",
                                         "[-1,-2,-3]"};
  int point = 0;
  for (const std::string& text : hostile) {
    for (const char* column : kPacked) {
      set(point, column, fmt::format("'{}'", text));
    }
    ++point;
  }
  set(point, "peaks", "'[1,2,3]' || char(0) || 'x'");
  set(point + 1, "duration", "NULL");
  set(point + 2, "duration", "'soon'");
  set(point + 3, "duration", "9223372036854775807");
  set(point + 4, "phases", "NULL");
  set(point + 5, "peaks", "NULL");
  open();
  for (int row = 0; row <= point + 5; ++row) {
    for (const char* column : kPacked) {
      const auto asked = [&](const char* where) {
        return answer(
            fmt::format("SELECT {} FROM {}.results WHERE point = {}", column, where, row));
      };
      EXPECT_EQ(asked("temp"), asked("main")) << column << " of row " << row;
    }
  }
}

TEST_F(QuickLists, AViewThatIsNotAsUsualStays) {
  editor_ = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(editor_.get(),
          "DROP VIEW results; CREATE VIEW results AS SELECT point FROM "
          "packed_results -- a comment\n");
  open();
  EXPECT_EQ(answer("SELECT count(*) FROM results"), "1:200\n");
  EXPECT_EQ(answer("SELECT count(*) FROM sqlite_temp_schema"), "1:0\n");
}

TEST_F(QuickLists, ModesThatAreLookedUpAreThoseThatAreJoined) {
  set(3, "mode", "NULL");
  set(4, "major_mode", "12345");  // of no text
  open();
  const std::string joined = answer("SELECT * FROM main.results ORDER BY point");
  EXPECT_EQ(answer(fmt::format("SELECT * FROM {} ORDER BY point", kUnjoinedResults)), joined);
  EXPECT_NE(joined, "");
}

TEST_F(QuickLists, QuestionsThatNameNoModeReadNoTexts) {
  open();
  const auto reads_texts = [&](const char* select, const char* group) {
    protocol::StudyQuery question;
    question.set_study("a");
    question.add_select(select);
    question.set_group(group);
    const std::string sql = plan(database_.get(), question).statement;
    return answer("EXPLAIN QUERY PLAN " + sql).find("mode") != std::string::npos;
  };
  EXPECT_FALSE(reads_texts("e, avg(fn_peak_N)", "e"));
  EXPECT_TRUE(reads_texts("major_mode, avg(fn_peak_N)", "major_mode"));
}

TEST(Unpacking, WritesNumbersAsSqliteDoes) {
  const auto database = open_database(":memory:", SQLITE_OPEN_READWRITE);
  DrawnLists drawn;
  Statement sqlite(database.get(), "SELECT json_array(?1 / ?2)");
  for (int i = 0; i < 5000; ++i) {
    const std::int64_t number = drawn.number() % 1'000'000'000'000'000;
    for (const auto& [decimals, units] : {std::pair(kTimeDecimals, 1e12), {kForceDecimals, 1e5}}) {
      sqlite.bind(1, number);
      sqlite.bind(2, units);
      ASSERT_TRUE(sqlite.step());
      std::string text = "[";
      append_decimal(number, decimals, text);
      ASSERT_EQ(text + "]", sqlite.text(0)) << number;
      sqlite.reset();
    }
  }
}

}  // namespace
}  // namespace oblique::server
