// Figures as tables and scripts, and what files are called.
#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/files/figure_table.h"
#include "client/plot/files/picture_file.h"
#include "tests/client/plot/figures_of_tests.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using testing::HasSubstr;

TEST(FigureTable, OfAMapHasARowACellWithItsState) {
  const auto csv = csv_of(test::gappy_map());
  EXPECT_TRUE(csv.starts_with("mu,H,duration_s,state\n")) << csv.substr(0, 80);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 25);
  EXPECT_THAT(csv, HasSubstr(",,no result\n"));
  EXPECT_THAT(csv, HasSubstr(",,failed\n"));
  EXPECT_THAT(csv, HasSubstr(",,no value\n"));
}

TEST(FigureTable, OfAMapHasTheValuesOfTheStudyWhereItHasAny) {
  Cells cells = test::counted_cells(2, 1);
  cells.x_values = {0.03, 0.1};
  cells.y_values = {0.7};
  const auto csv = csv_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), cells));
  EXPECT_EQ(csv, "mu,H,fn_peak_N,state\n0.03,0.7,0,solved\n0.1,0.7,1,solved\n");
}

TEST(FigureTable, OfKindsHasAllTheirNames) {
  const auto csv = csv_of(test::striped_kinds(40));
  EXPECT_THAT(csv, HasSubstr("mu,H,major_mode,state\n"));
  EXPECT_THAT(csv, HasSubstr(" 39,solved\n"));
}

TEST(FigureTable, OfLinesHasWhatTellsThemApart) {
  const auto csv = csv_of(test::lines_of_count(2, 2));
  EXPECT_EQ(
      csv, "e,mu,duration_s\n0.1,0.01,0.0001\n0.1,0.02,0.0002\n0.2,0.01,0.0002\n0.2,0.02,0.0004\n");
  EXPECT_EQ(csv_of(test::lines_of_count(1, 1)), "mu,duration_s\n0.01,0.0001\n");
}

TEST(FigureTable, OfPanelsHasOneBehindTheOther) {
  const auto csv = csv_of(test::panels());
  EXPECT_THAT(csv, HasSubstr("line,t_s,force_N\n"));
  EXPECT_THAT(csv, HasSubstr("published,5.7e-05,4282\n"));
  EXPECT_THAT(csv, HasSubstr("\n\nx_m,y_m\n"));
}

TEST(GnuplotScript, HoldsItsDataAndItsTexts) {
  for (const Figure& figure :
       {test::gappy_map(), test::striped_kinds(3), test::lines_of_count(3), test::dots_of_count(9),
        test::histogram_of_count(90), test::panels()}) {
    const auto script = gnuplot_of(figure, {});
    EXPECT_THAT(script, HasSubstr("$data0"));
    EXPECT_THAT(script, HasSubstr("\nEOD\n"));
    EXPECT_THAT(script, HasSubstr("plot "));
  }
}

TEST(GnuplotScript, IsNotSteeredByNames) {
  Figure figure = test::lines_of_count(1);
  figure.title = "it's\n`rm`";
  EXPECT_THAT(gnuplot_of(figure, {}), HasSubstr("set title 'it''s\\n`rm`, "));
}

TEST(PictureFormat, IsThatOfTheFileUnlessItIsNamed) {
  EXPECT_EQ(picture_format("", "a.svg"), PictureFormat::kSvg);
  EXPECT_EQ(picture_format("", "a.b/c.PNG"), PictureFormat::kPng);
  EXPECT_EQ(picture_format("", "a.gp"), PictureFormat::kGnuplot);
  EXPECT_EQ(picture_format("csv", "a.txt"), PictureFormat::kCsv);
  EXPECT_EQ(picture_format("", ""), PictureFormat::kSvg);
  EXPECT_THROW(picture_format("", "a.pdf"), solver::InputError);
  EXPECT_THROW(picture_format("pdf", "a.svg"), solver::InputError);
}

TEST(PictureSize, IsTwoWholeNumbersThatCanBeRead) {
  EXPECT_EQ(size_of("480x360").width, 480.0);
  EXPECT_EQ(size_of("480x360").height, 360.0);
  for (const char* text : {"", "480", "x", "480x", "0x0", "480.5x360", "1e9x300", "nanx300"}) {
    EXPECT_THROW(size_of(text), solver::InputError) << text;
  }
}

}  // namespace
}  // namespace oblique::client::plot
