// What a merge says of studies as a whole: whether they are done, and where rows came from.
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/care/diagnosis.h"
#include "tests/server/care/merge_fixture.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// The points from 0.5 on of ten from 0 to 1: numbers 5 to 9.
Table filtered_table() {
  protocol::Recipe recipe = table_of(10)->recipe();
  recipe.mutable_blocks(0)->set_where("mu > 0.5");
  protocol::PointTable table(recipe);
  table.survey([] { return true; });
  return std::make_shared<const protocol::PointTable>(std::move(table));
}

TEST_F(MergeTest, AStudyIsDoneWhenAllIsThereThatItsFilterLeavesIn) {
  store("one", {{.table = filtered_table(), .first = 5, .end = 8}});
  store("two", {{.table = filtered_table(), .first = 8, .end = 10}});
  const auto state = [&] {
    return text("all", "SELECT state || ' ' || counted || ' ' || points FROM studies");
  };
  merge("one");
  EXPECT_EQ(state(), "running 1 5");
  merge("two");
  EXPECT_EQ(state(), "done 1 5");
  EXPECT_THAT(texts("all", "SELECT first_point || '+' || points FROM settled_points"),
              ElementsAre("5+5"));
  EXPECT_THAT(find_faults(file("all")), IsEmpty());
}

TEST_F(MergeTest, RowsThatWereTakenOverNameTheirOriginInTheWholeAndAreCounted) {
  store("one",
        {{.study = "a", .end = 4}, {.study = "gone", .first = 4, .end = 10}, {.study = "b"}});
  {
    Store store(file("one"));
    const auto outcome = std::make_shared<ReusedResults>();
    store.commit(std::vector<Change>{ReuseResults{3, table_of(10), 0, "0.1", outcome},
                                     RenameStudy{1, "first"}, DeleteStudy{2}});
    while (store.clear_away(100) != ClearedAway::kAll) {
    }
  }
  store("all", {{.study = "first", .table = table_of(3), .end = 3}, {.study = "x"}});
  const std::string origins =
      "SELECT group_concat(taken_from) FROM (SELECT * FROM runs WHERE study = 'b' ORDER BY point)";
  const std::string counts =
      "SELECT o.name || ' ' || t.points FROM taken_points AS t JOIN origins AS o USING (origin_id)"
      " JOIN studies AS s USING (study_id) WHERE s.name = 'b' ORDER BY o.name";
  for (int i = 0; i < 2; ++i) {
    merge("one", {.rename_prefix = "other "});
    EXPECT_EQ(
        text("all", origins),
        "other first/0,other first/1,other first/2,other first/3,gone (deleted)/4,"
        "gone (deleted)/5,gone (deleted)/6,gone (deleted)/7,gone (deleted)/8,gone (deleted)/9");
    EXPECT_THAT(texts("all", counts), ElementsAre("gone (deleted) 6", "other first 4"));
    EXPECT_THAT(find_faults(file("all")), IsEmpty());
  }
  EXPECT_EQ(text("all", "SELECT count(*) FROM origins"), "2");
  // No study will have the number by which the whole knows what is gone.
  Store all(file("all"));
  EXPECT_GE(all.last_study_id(), std::stoull(text("all", "SELECT max(origin_id) FROM origins")));
}

TEST_F(MergeTest, AStudyIsNotGivenTheNumberOfRowsWhoseStudyWasDeletedByHand) {
  store("one", {{.study = "b", .table = table_of(3), .end = 2}});
  store("all", {{.study = "a", .end = 10}});
  execute(open_database(file("all"), SQLITE_OPEN_READWRITE).get(), "DELETE FROM studies");
  merge("one");
  EXPECT_EQ(text("all", "SELECT count(*) FROM runs WHERE study = 'b'"), "2");
}

}  // namespace
}  // namespace oblique::server
