// Figures written as gnuplot scripts, drawn by gnuplot, and written as CSV.
#include "client/plot/picture_file.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/plot/figures_of_tests.h"
#include "tests/support/amount.h"
#include "tests/support/programs.h"

namespace oblique::client::plot {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string script(const Figure& figure) {
  return script_of(figure, PictureFormat::kSvg, {});
}

std::vector<std::pair<std::string, Figure>> all_figures() {
  Figure log_lines = test::lines_of(3, 5);
  log_lines.panels[0].x.is_logarithmic = true;
  Figure coloured_lines = test::lines_of(9, 5);
  coloured_lines.colours = axis_of("e", "");
  for (Curve& curve : coloured_lines.panels[0].curves) {
    curve.colours.assign(curve.x.size(), *curve.by);
  }
  return {{"map of numbers", test::gappy_map()},
          {"map of categories", test::category_map()},
          {"lines", test::lines_of(3, 5)},
          {"logarithmic lines", log_lines},
          {"coloured lines", coloured_lines},
          {"points", test::some_dots()},
          {"histogram", test::some_bars()},
          {"histogram of texts", test::named_bars()},
          {"panels", test::panels()},
          {"nothing", test::figure_with({})}};
}

TEST(GnuplotScript, OfALineIsShortAndReadable) {
  const auto text = script_of(test::lines_of(1, 2), PictureFormat::kSvg, {400, 300}, "picture.svg");
  EXPECT_THAT(text, StartsWith(R"(# A picture made by `oblique plot`, for gnuplot 5.4 or later.
# Run it with `gnuplot`; for PDF or PNG set the terminal to pdfcairo or pngcairo.
set terminal svg size 400,300 font 'DejaVu Sans,12' background '#ffffff'
set output 'picture.svg'
)"));
  EXPECT_THAT(text, testing::EndsWith(R"(
# Axes
set origin 0.0000, 0.0200
set size noratio 1.0000, 0.8100
set tmargin at screen 0.7900
set xlabel 'coefficient of friction μ' noenhanced
unset logscale x
set xtics autofreq
set format x '%h'
set xrange [0.01:0.02]
set ylabel 'duration of contact [µs]' noenhanced
unset logscale y
set ytics autofreq
set format y '%h'
set yrange [0:200]
$data1 << EOD
0.01 100
0.02 200
EOD
set key rmargin top vertical maxcols 1
plot $data1 using 1:2 with linespoints ls 1 notitle
)"));
}

TEST(GnuplotScript, EscapesTextsSoThatTheyAppearUnchanged) {
  EXPECT_EQ(gnuplot_text("it's\n`rm` \"x\" $y"), "'it\u2019s\\n`rm` \"x\" $y'");
  Figure figure = test::lines_of(1, 2);
  figure.title = "a_b^c {x} `rm` it's";
  EXPECT_THAT(script(figure), HasSubstr("'{/:Bold*1.25 a\\_b\\^c \\{x\\} `rm` it\u2019s}'"));
  EXPECT_THAT(script(test::named_bars("100 % a_b")), HasSubstr("('100 %% a_b' 0, "));
}

TEST(GnuplotScript, DistinguishesCellsWithoutAValue) {
  const auto text = script(test::gappy_map());
  EXPECT_THAT(text, AllOf(HasSubstr("'no result (1)'"), HasSubstr("'excluded by --where (1)'"),
                          HasSubstr("'failed (1)'")));
  for (const char* number : {"0", "1", "2"}) {
    EXPECT_THAT(text, HasSubstr("using ($7==" + std::string(number) +
                                "?$1:NaN):2:3:4:5:6 with boxxyerror fs transparent pattern"));
  }
}

TEST(GnuplotScript, OfCategoriesHasPatternsLettersBordersAndPercentages) {
  const auto text = script(test::category_map());
  EXPECT_THAT(text, AllOf(HasSubstr("'SC sR (50\u00a0%)'"), HasSubstr("'sC (42\u00a0%)'"),
                          HasSubstr("'2 other modes (8.3\u00a0%)'"), HasSubstr("'no result (1)'")));
  EXPECT_THAT(text, AllOf(HasSubstr("set label '{/:Bold A}' at "), HasSubstr("{/:Bold B}' at ")));
  EXPECT_THAT(text, HasSubstr("using ($7==1?$1:NaN)"));
  EXPECT_THAT(text, HasSubstr("# Borders of categories: x y dx dy\n"));
}

TEST(GnuplotScript, DrawsScatteredCategoriesWithoutBordersAndPatterns) {
  Figure figure = test::category_map();
  for (std::size_t i = 0; i < figure.panels[0].cells->values.size(); ++i) {
    figure.panels[0].cells->values[i] = static_cast<double>((i % 30 * 7 + i / 30 * 11) % 3);
  }
  EXPECT_THAT(script(figure), AllOf(Not(HasSubstr("# Borders of categories")),
                                    Not(HasSubstr("using ($7==1?$1:NaN)"))));
}

TEST(GnuplotScript, DrawsLinesThatDifferInColourDashesAndMarks) {
  const auto text = script(test::lines_of(8, 3));
  std::set<std::string> styles;
  for (int style = 1; style <= 8; ++style) {
    EXPECT_THAT(text, HasSubstr(" with linespoints ls " + std::to_string(style)));
    const auto begin = text.find("lc ", text.find("set style line " + std::to_string(style)));
    styles.insert(text.substr(begin, text.find('\n', begin) - begin));
  }
  EXPECT_EQ(styles.size(), 8U);
}

TEST(GnuplotScript, HasUnitsAndLogarithmicAxesWithSeveralTicks) {
  Figure figure = test::lines_of(1, 5);
  figure.panels[0].x.is_logarithmic = true;
  figure.panels[0].x.range = {0.01, 2.0};
  const auto text = script(figure);
  EXPECT_THAT(text, HasSubstr("set ylabel 'duration of contact [\u00b5s]' noenhanced"));
  EXPECT_THAT(
      text,
      HasSubstr("set logscale x\nset xtics ()\ndo for [power=-2:0] { do for [digit in '1 2 5']"));
  EXPECT_THAT(text, HasSubstr("set yrange [0:500]"));
}

/// Returns the numbers that gnuplot writes below the horizontal axis of a line over `range`.
std::vector<std::string> numbers_below(const Range& range, bool is_logarithmic) {
  Figure figure = test::lines_of(1, 5);
  Panel& panel = figure.panels[0];
  panel.x.is_logarithmic = is_logarithmic;
  panel.x.range = range;
  panel.curves[0].x = {range.from, range.to};
  panel.curves[0].y = {0.0, 1.0};
  const auto text = output_of_gnuplot(script_for_terminal(figure, 80, 24, false));
  // The numbers are in the line above that of the label.
  std::vector<std::string> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);) {
    if (line.find("coefficient of friction") != std::string::npos) {
      break;
    }
    lines.push_back(line);
  }
  std::istringstream words(lines.back());
  return {std::istream_iterator<std::string>(words), {}};
}

TEST(GnuplotScript, MarksALogarithmicAxisOfAnyRangeWithSeveralDifferentNumbers) {
  if (std::system("command -v gnuplot > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnuplot is not installed (Debian: gnuplot-nox)";
  }
  int pair = 0;
  for (const double from : {1e-300, 3e-14, 0.011, 1.0, 6.1e10, 2.1e7, 1e200}) {
    for (const double ratio :
         {1.0 + 1e-9, 1.001, 1.05, 1.38, 3.3, 7.8, 12.0, 99.0, 450.0, 2e4, 1e40, 1e95}) {
      if (++pair % oblique::test::amount(5, 1) != 0) {
        continue;
      }
      SCOPED_TRACE(testing::Message() << from << " times " << ratio);
      const auto numbers = numbers_below({from, from * ratio}, true);
      EXPECT_GE(std::set<std::string>(numbers.begin(), numbers.end()).size(), 2U);
      EXPECT_LE(numbers.size(), 13U);
    }
  }
}

TEST(GnuplotScript, DrawsRangesOfAnyWidthAndSizeInEveryKindOfPicture) {
  if (std::system("command -v gnuplot > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnuplot is not installed (Debian: gnuplot-nox)";
  }
  int pair = 0;
  for (const double value : {0.0, 1.0, -0.3, 1e9, 5e-324, 1e300}) {
    for (const double spread : {0.0, 4e-16, 1e-12, 3e-12, 1e-10, 1e-8, 1e-6}) {
      if (++pair % oblique::test::amount(3, 1) != 0) {
        continue;
      }
      SCOPED_TRACE(testing::Message() << value << " and a spread of " << spread);
      std::vector<double> values;
      for (double i = 0.0; i < 5.0; ++i) {
        values.push_back(value * (1.0 + spread * i));
      }
      Panel panel = test::panel_over_mu_and_H();
      panel.x.span(range_of(values));
      panel.y.span(range_of(values), 0.05);
      Figure lines = test::figure_with(panel);
      lines.panels[0].curves = {{.name = "a", .x = values, .y = values, .colours = values}};
      lines.colours = panel.x;
      Figure map = test::figure_with(panel);
      const auto different = axis_values({}, {.name = "mu", .unit = {}, .numbers = values});
      const CellAxis axis = cells_around(different, false);
      const std::size_t cells = axis.values.size() * axis.values.size();
      map.panels[0].cells = Cells{.name = "a",
                                  .x = axis,
                                  .y = axis,
                                  .values = std::vector<double>(cells, values[1]),
                                  .states = std::vector<CellState>(cells, CellState::kSolved)};
      map.panels[0].x.range = map.panels[0].y.range = {axis.edges.front(), axis.edges.back()};
      map.colours = panel.x;
      Figure bars = test::figure_with(panel);
      bars.panels[0].bars = binned(values, panel.x);
      EXPECT_LE(bars.panels[0].bars->heights.size(), 200U);
      for (const Figure& figure : {lines, map, bars}) {
        EXPECT_THAT(picture_of(figure, PictureFormat::kSvg), HasSubstr("</svg>"));
        EXPECT_FALSE(output_of_gnuplot(script_for_terminal(figure, 80, 24, false)).empty());
      }
    }
  }
}

TEST(GnuplotScript, WritesNarrowRangesAsDifferencesFromANumberInTheLabel) {
  Figure figure = test::lines_of(1, 2);
  Panel& panel = figure.panels[0];
  panel.x.range = {0.4, 0.400000001};
  panel.y.range = {-2.5e-3, -2.5e-3 + 1e-12};
  panel.curves[0].x = {0.4, 0.4000000005};
  const auto text = script(figure);
  EXPECT_THAT(text, HasSubstr("set xlabel 'coefficient of friction \u03bc \u2212 0.4' noenhanced"));
  EXPECT_THAT(text, HasSubstr("set ylabel 'duration of contact + 2500 [\u00b5s]' noenhanced"));
  EXPECT_THAT(text, testing::ContainsRegex("set xrange \\[0:[19]\\.?[0-9]*e-(09|10)\\]"));
}

TEST(GnuplotScript, KeepsThePeaksOfACurveWithManyPoints) {
  Figure figure = test::lines_of(1, 5001);
  Curve& curve = figure.panels[0].curves[0];
  curve.mark = Curve::Mark::kLine;
  curve.y[1234] = 9.876543;
  const auto text = script(figure);
  EXPECT_THAT(text, HasSubstr(" 9876543\n"));
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 1500);
}

TEST(GnuplotScript, OfAFigureWithoutPanelsIsRefused) {
  EXPECT_ANY_THROW(picture_of({}, PictureFormat::kSvg));
  EXPECT_ANY_THROW(picture_of({}, PictureFormat::kScript));
  EXPECT_ANY_THROW(picture_of({}, PictureFormat::kCsv));
  EXPECT_ANY_THROW(text_of({}));
}

TEST(GnuplotScript, ShadesPhasesAndStickAndNamesThemOnce) {
  Figure figure = test::panels();
  figure.panels[1] = figure.panels[0];
  const auto text = script(figure);
  EXPECT_THAT(text, HasSubstr("from 0, graph 0 to 70, graph 1 behind fs solid"));
  EXPECT_THAT(text, HasSubstr("from 0, graph 0 to 50, graph 1 behind fs transparent pattern"));
  EXPECT_EQ(text.find("title 'stick'"), text.rfind("title 'stick'"));
  EXPECT_THAT(text, HasSubstr("title 'published'"));
}

TEST(GnuplotScript, IsDrawnByGnuplotInEveryFormat) {
  if (std::system("command -v gnuplot > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnuplot is not installed (Debian: gnuplot-nox)";
  }
  for (const auto& [name, figure] : all_figures()) {
    SCOPED_TRACE(name);
    const auto svg = picture_of(figure, PictureFormat::kSvg);
    EXPECT_THAT(svg, AllOf(StartsWith("<?xml"), HasSubstr("</svg>")));
    EXPECT_THAT(picture_of(figure, PictureFormat::kPdf), StartsWith("%PDF"));
    EXPECT_THAT(picture_of(figure, PictureFormat::kPng), StartsWith("\x89PNG"));
    EXPECT_THAT(output_of_gnuplot(script_for_terminal(figure, 80, 40, true)), HasSubstr("\x1b["));
    EXPECT_THAT(output_of_gnuplot(script_for_terminal(figure, 80, 40, false)),
                AllOf(Not(HasSubstr("\x1b[")), testing::ContainsRegex("[^ \n\f]")));
  }
}

TEST(GnuplotScript, DoesNotExecuteTexts) {
  if (std::system("command -v gnuplot > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnuplot is not installed (Debian: gnuplot-nox)";
  }
  const oblique::test::TemporaryFolder folder;
  const auto made = (folder.path() / "made").string();
  for (const std::string& text : std::vector<std::string>{
           "`touch " + made + "`", "'; system('touch " + made + "'); print '", "\"; !touch " + made,
           "x\n!touch " + made + "\n", "@made $(touch " + made + ")", "%s%n\\", "{/Bold", "EOD"}) {
    SCOPED_TRACE(text);
    std::vector<Figure> figures{test::category_map(text), test::named_bars(text),
                                test::lines_of(2, 3), test::panels()};
    for (Figure& figure : figures) {
      figure.title = figure.subtitle = text;
      figure.notes = {text};
      for (Panel& panel : figure.panels) {
        panel.title = panel.x.label = panel.y.label = text;
        for (Curve& curve : panel.curves) {
          curve.name = text;
        }
      }
      EXPECT_THAT(picture_of(figure, PictureFormat::kSvg), HasSubstr("</svg>"));
      EXPECT_FALSE(output_of_gnuplot(script_for_terminal(figure, 80, 40, false)).empty());
      EXPECT_FALSE(std::filesystem::exists(made));
    }
  }
}

TEST(Gnuplot, ReportsTheReasonOfAFailure) {
  if (std::system("command -v gnuplot > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnuplot is not installed (Debian: gnuplot-nox)";
  }
  try {
    (void)output_of_gnuplot("set terminal svg\nplot nonsense(x)\n");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(StartsWith("gnuplot "), HasSubstr("undefined function")));
  }
}

TEST(PictureFormat, FollowsFromTheFileNameUnlessAFlagNamesIt) {
  EXPECT_EQ(picture_format("", "a.svg"), PictureFormat::kSvg);
  EXPECT_EQ(picture_format("", "a.b/c.png"), PictureFormat::kPng);
  EXPECT_EQ(picture_format("", "a.gp"), PictureFormat::kScript);
  EXPECT_EQ(picture_format("csv", "a.txt"), PictureFormat::kCsv);
  EXPECT_EQ(picture_format("", ""), PictureFormat::kSvg);
}

TEST(PictureSize, IsTwoWholeNumbersOfALegibleSize) {
  EXPECT_EQ(size_of("480x360").width, 480.0);
  EXPECT_EQ(size_of("480x360").height, 360.0);
  for (const char* text : {"", "480", "x", "480x", "0x0", "480.5x360", "1e9x300", "nanx300"}) {
    EXPECT_ANY_THROW(size_of(text)) << text;
  }
}

TEST(FigureTable, OfAMapHasOneRowPerCellWithItsState) {
  const auto csv = csv_of(test::gappy_map());
  EXPECT_TRUE(csv.starts_with("mu,H,duration_s,state\n")) << csv.substr(0, 80);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 25);
  for (const char* state : {"no result", "filtered", "failed", "no value"}) {
    EXPECT_THAT(csv, HasSubstr(",," + std::string(state) + "\n"));
  }
}

TEST(FigureTable, OfAMapHasTheAxisValuesOfTheStudyIfItListsThem) {
  Cells cells = test::counted_cells(2, 1);
  cells.x.values = {0.03, 0.1};
  cells.y.values = {0.7};
  EXPECT_EQ(csv_of(test::map_of(cells)),
            "mu,H,duration_s,state\n0.03,0.7,0,solved\n0.1,0.7,1,solved\n");
}

TEST(FigureTable, OfLinesHasTheColumnThatDistinguishesThem) {
  EXPECT_EQ(
      csv_of(test::lines_of(2, 2)),
      "e,mu,duration_s\n0.1,0.01,0.0001\n0.1,0.02,0.0002\n0.2,0.01,0.0002\n0.2,0.02,0.0004\n");
  EXPECT_EQ(csv_of(test::lines_of(1, 1)), "mu,duration_s\n0.01,0.0001\n");
}

TEST(FigureTable, OfBarsHasTheirEdgesOrNames) {
  EXPECT_EQ(csv_of(test::some_bars()), "mu_from,mu_to,points\n0,0.5,1\n0.5,1,4\n1,1.5,0\n");
  EXPECT_EQ(csv_of(test::named_bars("a,b")), "mode,points\n\"a,b\",4\nother: 3,1\n");
}

}  // namespace
}  // namespace oblique::client::plot
