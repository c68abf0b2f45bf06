// Figures as CSV.
#include "client/plot/picture_file.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

using testing::HasSubstr;

TEST(FigureTable, OfAMapHasARowACellWithItsState) {
  const auto csv = csv_of(test::gappy_map());
  EXPECT_TRUE(csv.starts_with("mu,H,duration_s,state\n")) << csv.substr(0, 80);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 25);
  for (const char* state : {"no result", "filtered", "failed", "no value"}) {
    EXPECT_THAT(csv, HasSubstr(",," + std::string(state) + "\n"));
  }
}

TEST(FigureTable, OfAMapHasTheValuesOfTheStudyWhereItHasAny) {
  Cells cells = test::counted_cells(2, 1);
  cells.x.values = {0.03, 0.1};
  cells.y.values = {0.7};
  EXPECT_EQ(csv_of(test::map_of(cells)),
            "mu,H,duration_s,state\n0.03,0.7,0,solved\n0.1,0.7,1,solved\n");
}

TEST(FigureTable, OfCategoriesHasAllTheirNames) {
  const auto csv = csv_of(test::category_map());
  EXPECT_THAT(csv, HasSubstr("mu,H,major_mode,state\n"));
  EXPECT_THAT(csv, HasSubstr(",rare,solved\n"));
}

TEST(FigureTable, OfLinesHasWhatTellsThemApart) {
  EXPECT_EQ(
      csv_of(test::lines_of(2, 2)),
      "e,mu,duration_s\n0.1,0.01,0.0001\n0.1,0.02,0.0002\n0.2,0.01,0.0002\n0.2,0.02,0.0004\n");
  EXPECT_EQ(csv_of(test::lines_of(1, 1)), "mu,duration_s\n0.01,0.0001\n");
}

TEST(FigureTable, OfBarsHasTheirEdgesOrNames) {
  EXPECT_EQ(csv_of(test::some_bars()), "mu_from,mu_to,points\n0,0.5,1\n0.5,1,4\n1,1.5,0\n");
  EXPECT_EQ(csv_of(test::named_bars("a,b")), "mode,points\n\"a,b\",4\nother: 3,1\n");
}

TEST(FigureTable, OfPanelsHasOneBehindTheOther) {
  const auto csv = csv_of(test::panels());
  EXPECT_THAT(csv, HasSubstr("line,t_s,force_N\n"));
  EXPECT_THAT(csv, HasSubstr("published,5.7e-05,4282\n"));
  EXPECT_THAT(csv, HasSubstr("\n\nx_m,y_m\n"));
}

}  // namespace
}  // namespace oblique::client::plot
