// `oblique plot` as people call it.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A folder with oblique.db: a study `a` of which 4 of 12 points have a result.
class Plot : public testing::Test {
 protected:
  Plot() {
    server::Store store((folder_.path() / "oblique.db").string());
    test::add_study(store, "a", 12, 4);
  }
  test::Outcome plot(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "plot");
    const auto says_where = [](const std::string& word) {
      return word == "--out" || word == "--format" || word == "--show" || word == "--help";
    };
    if (std::none_of(arguments.begin(), arguments.end(), says_where)) {
      arguments.insert(arguments.end(), {"--format", "svg"});
    }
    return test::run_oblique(folder_, arguments);
  }
  std::string file(const std::string& name) const {
    std::ifstream in(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  test::TemporaryFolder folder_;
};

TEST_F(Plot, DrawsAStudyWithoutBeingToldWhat) {
  const auto outcome = plot({"a"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(outcome.out.starts_with("<?xml")) << outcome.out.substr(0, 100);
  EXPECT_TRUE(outcome.out.find("</svg>") != std::string::npos);
  EXPECT_THAT(outcome.out, HasSubstr("a: fn"));
}

TEST_F(Plot, IntoAPipeAsksForAFile) {
  const auto outcome = test::run_oblique(folder_, {"plot", "a"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("--out FILE.svg"));
}

TEST_F(Plot, WritesWhatTheFilesEndingSays) {
  EXPECT_EQ(plot({"a", "--out", "a.svg"}).exit_code, 0);
  EXPECT_EQ(plot({"a", "--out", "a.csv"}).exit_code, 0);
  EXPECT_EQ(plot({"a", "--out", "a.gp"}).exit_code, 0);
  EXPECT_EQ(plot({"a", "--out", "a.txt", "--format", "csv"}).out, "");
  EXPECT_TRUE(file("a.svg").starts_with("<?xml"));
  EXPECT_THAT(file("a.csv"), HasSubstr("fn_peak_N"));
  EXPECT_EQ(file("a.csv"), file("a.txt"));
  EXPECT_THAT(file("a.gp"), HasSubstr("set terminal svg"));
}

TEST_F(Plot, WritesThroughALink) {
  std::filesystem::create_directory(folder_.path() / "pictures");
  std::ofstream(folder_.path() / "pictures" / "old.svg") << "old";
  std::filesystem::create_symlink("pictures/old.svg", folder_.path() / "link.svg");
  EXPECT_EQ(plot({"a", "--out", "link.svg"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path() / "link.svg"));
  EXPECT_TRUE(file("pictures/old.svg").starts_with("<?xml"));
}

TEST_F(Plot, WritesPdfAndPngWithTwoPixelsForOne) {
  EXPECT_EQ(plot({"a", "--out", "a.pdf"}).exit_code, 0);
  EXPECT_TRUE(file("a.pdf").starts_with("%PDF"));
  const auto outcome = plot({"a", "--size", "400x300", "--out", "a.png"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string png = file("a.png");
  EXPECT_TRUE(png.starts_with("\x89PNG")) << png.size();
  ASSERT_GT(png.size(), 24U);
  EXPECT_EQ(png.substr(16, 4), std::string("\x00\x00\x03\x20", 4));
}

TEST_F(Plot, WithoutGnuplotNamesItsPackageAndTheScriptThatNeedsNone) {
  const auto without_gnuplot = [this](const std::string& out) {
    return test::Process(folder_, test::client_program(), {"plot", "a", "--out", out},
                         {{"PATH", "/nowhere"}})
        .outcome();
  };
  const auto outcome = without_gnuplot("a.svg");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("gnuplot-nox"));
  EXPECT_THAT(outcome.err, HasSubstr("--out FILE.gp"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "a.svg"));
  EXPECT_EQ(without_gnuplot("a.gp").exit_code, 0);
  EXPECT_EQ(without_gnuplot("a.csv").exit_code, 0);
}

TEST_F(Plot, WritesAScriptThatGnuplotRunsAgain) {
  EXPECT_EQ(plot({"a", "--out", "a.gp"}).exit_code, 0);
  EXPECT_EQ(std::system(("cd " + folder_.path().string() + " && gnuplot a.gp").c_str()), 0);
  EXPECT_THAT(file("picture.svg"), HasSubstr("</svg>"));
}

TEST_F(Plot, LeavesNoFileWhereItFails) {
  EXPECT_EQ(plot({"a", "--map", "fn_peak", "--x", "mu", "--y", "H", "--out", "a.svg"}).exit_code,
            2);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "a.svg"));
}

TEST_F(Plot, ShowsAsciiInAPipe) {
  const auto outcome = plot({"a", "--histogram", "fn_peak_N", "--show"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("a: fn_peak_N"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(outcome.out, Not(HasSubstr("<svg")));
}

TEST_F(Plot, DrawsNothingOfNothingAndSaysSo) {
  const auto outcome = plot({"a", "--histogram", "fn_peak_N", "--where", "mu > 1e9"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Nothing to draw"));
  EXPECT_THAT(outcome.out, HasSubstr("0 points"));
}

TEST_F(Plot, OfAMapTellsWhatIsNotSolvedFromWhatTheConditionLeavesOut) {
  {
    server::Store store((folder_.path() / "oblique.db").string());
    const auto table = std::make_shared<const protocol::PointTable>(
        protocol::recipe_of({{protocol::range("H", 0.5, 1.0, 2), protocol::range("mu", 0.0, 1.0, 3),
                              protocol::listed("e", {1.0})}}));
    const std::vector<server::Change> changes{
        server::AddStudy{2, "grid", table, "2024-01-01T00:00:00.000Z"},
        server::AddResults{
            2,
            table,
            0,
            "",
            "",
            1,
            "now",
            {server::solved_point(0), server::solved_point(1), server::solved_point(2)}}};
    store.commit(changes);
  }
  const std::vector<std::string> asked{
      "grid", "--map", "fn_peak_N", "--where", "fn_peak_N < 20000", "--format"};
  const auto as = [&](const std::string& format) {
    auto arguments = asked;
    arguments.push_back(format);
    return plot(arguments).out;
  };
  const auto lines_with = [](const std::string& text, const std::string& part) {
    std::istringstream in(text);
    std::string line;
    std::size_t count = 0;
    while (std::getline(in, line)) {
      count += line.ends_with(part) ? 1U : 0U;
    }
    return count;
  };
  const auto csv = as("csv");
  EXPECT_EQ(lines_with(csv, ",solved"), 2U) << csv;
  EXPECT_EQ(lines_with(csv, ",filtered"), 1U) << csv;
  EXPECT_EQ(lines_with(csv, ",no result"), 3U) << csv;
  const auto svg = as("svg");
  EXPECT_THAT(svg, HasSubstr("no result (3)"));
  EXPECT_THAT(svg, HasSubstr("left out by --where (1)"));
}

TEST_F(Plot, OfNoValueSaysSoOnStandardErrorAndHasNoColours) {
  const auto outcome =
      plot({"a", "--scatter", "mu,fn_peak_N", "--colour", "duration_s", "--where", "mu > 5"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("No point of the picture has a value"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("gradient")));
  EXPECT_THAT(plot({"a", "--histogram", "fn_peak_N"}).err, Not(HasSubstr("No point")));
}

TEST_F(Plot, OfAWrongFlagNamesItAndWhatIsAllowed) {
  struct Wrong {
    std::vector<std::string> arguments;
    std::string says;
    int exit_code = 2;
  };
  for (const Wrong& wrong :
       std::vector<Wrong>{{{"b"}, "no study called", 1},
                          {{"a", "--histogram", "fn_peak"}, "did you mean `fn_peak_N`"},
                          {{"a", "--histogram", "mu;"}, "--histogram"},
                          {{"a", "--histogram", "fn_peak_N", "--where", "mu) OR (1"}, "--where"},
                          {{"a", "--map", "mode", "--lines", "mu"}, "excludes"},
                          {{"a", "--scatter", "mu"}, "two columns"},
                          {{"a", "--scatter", "mu,major_mode"}, "texts"},
                          {{"a", "--scatter", "mu,fn_peak_N", "--colour", "major_mode"},
                           "--colour major_mode: its values are texts"},
                          {{"a", "--histogram", "fn_peaks_N"}, "fn_peaks_N[0]"},
                          {{"a", "--at", "q=1"}, "no axis q"},
                          {{"a", "--range", "1"}, "FROM:TO"},
                          {{"a", "--size", "1x1"}, "WIDTHxHEIGHT"},
                          {{"a", "--out", "a.bmp"}, ".svg, .pdf, .png, .gp or .csv"},
                          {{"a", "--format", "jpg"}, "svg, pdf, png, gp or csv"},
                          {{"a", "--show", "--format", "csv"}, "--out FILE"},
                          {{"a", "--out", "no/such/folder.svg"}, "cannot be written"}}) {
    const auto outcome = plot(wrong.arguments);
    EXPECT_EQ(outcome.exit_code, wrong.exit_code) << wrong.says << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(wrong.says));
    EXPECT_EQ(outcome.out, "") << wrong.says;
  }
}

}  // namespace
}  // namespace oblique::client
