// `oblique plot` and `oblique paper --figures`.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
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

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string contents_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// A folder whose oblique.db contains a study `a` with results for 4 of 12 points.
class Plot : public testing::Test {
 protected:
  Plot() {
    server::Store store(folder_.file("oblique.db"));
    test::add_study(store, "a", 12, 4);
  }
  /// Runs `oblique plot`, which writes SVG to standard output unless `arguments` set an output.
  test::Outcome plot(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "plot");
    const auto says_where = [](const std::string& word) {
      return word == "--out" || word == "--format" || word == "--show";
    };
    if (std::none_of(arguments.begin(), arguments.end(), says_where)) {
      arguments.insert(arguments.end(), {"--format", "svg"});
    }
    return test::run_oblique(folder_, arguments);
  }
  std::string file(const std::string& name) const { return contents_of(folder_.path() / name); }

  test::TemporaryFolder folder_;
};

TEST_F(Plot, WritesTheFormatOfTheExtensionAndNeedsAFileIfOutputIsAPipe) {
  const auto unasked = plot({"a"});
  EXPECT_EQ(unasked.exit_code, 0) << unasked.err;
  EXPECT_THAT(unasked.out, AllOf(StartsWith("<?xml"), HasSubstr("a: fn"), HasSubstr("</svg>")));
  EXPECT_EQ(plot({"a", "--out", "a.csv"}).exit_code, 0);
  EXPECT_EQ(plot({"a", "--out", "a.txt", "--format", "csv"}).out, "");
  EXPECT_THAT(file("a.csv"), HasSubstr("fn_peak_N"));
  EXPECT_EQ(file("a.csv"), file("a.txt"));
  EXPECT_EQ(plot({"a", "--out", "a.pdf"}).exit_code, 0);
  EXPECT_THAT(file("a.pdf"), StartsWith("%PDF"));
  EXPECT_EQ(plot({"a", "--size", "400x300", "--out", "a.png"}).exit_code, 0);
  const std::string png = file("a.png");
  EXPECT_THAT(png, StartsWith("\x89PNG"));
  ASSERT_GT(png.size(), 24U);
  EXPECT_EQ(png.substr(16, 4), std::string("\x00\x00\x03\x20", 4))
      << "a PNG has two pixels per unit of size";
  const auto pipe = test::run_oblique(folder_, {"plot", "a"});
  EXPECT_EQ(pipe.exit_code, 2);
  EXPECT_EQ(pipe.out, "");
  EXPECT_THAT(pipe.err, HasSubstr("--out FILE.svg"));
}

TEST_F(Plot, WithoutGnuplotNamesItsPackageAndTheFormatThatDoesNotNeedIt) {
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
  EXPECT_THAT(file("a.gp"), HasSubstr("set terminal svg"));
  EXPECT_THAT(file("picture.svg"), HasSubstr("</svg>"));
}

TEST_F(Plot, ShowsAsciiInAPipe) {
  const auto outcome = plot({"a", "--histogram", "fn_peak_N", "--show"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("a: fn_peak_N"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(outcome.out, Not(HasSubstr("<svg")));
}

TEST_F(Plot, ReportsMissingValuesOnStandardError) {
  const auto outcome =
      plot({"a", "--scatter", "mu,fn_peak_N", "--colour", "duration_s", "--where", "mu > 5"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("No point has a value"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("gradient")));
  EXPECT_THAT(plot({"a", "--histogram", "fn_peak_N"}).err, Not(HasSubstr("No point")));
}

TEST_F(Plot, AWrongFlagIsNamedWithTheAllowedValues) {
  struct Wrong {
    std::vector<std::string> arguments;
    std::string expected;
    int exit_code = 2;
  };
  for (const Wrong& wrong :
       std::vector<Wrong>{{{"b"}, "no study called", 1},
                          {{"a", "--histogram", "fn_peak_N", "--where", "mu) OR (1"}, "--where"},
                          {{"a", "--map", "mode", "--lines", "mu"}, "excludes"},
                          {{"a", "--scatter", "mu,fn_peak_N", "--colour", "major_mode"},
                           "--colour major_mode: its values are texts"},
                          {{"a", "--histogram", "fn_peaks_N"}, "fn_peaks_N[0]"},
                          {{"a", "--range", "1"}, "FROM:TO"},
                          {{"a", "--size", "1x1"}, "WIDTHxHEIGHT"},
                          {{"a", "--out", "a.bmp"}, ".svg, .pdf, .png, .gp or .csv"},
                          {{"a", "--format", "jpg"}, "svg, pdf, png, gp, csv"},
                          {{"a", "--show", "--format", "csv"}, "--out FILE"},
                          {{"a", "--out", "no/such/folder.svg"}, "cannot be written"},
                          {{"a", "--histogram", "fn_peak_N", "--log-x", "--range", "0:1"},
                           "--range 0:1 is not allowed with --log-x"},
                          {{}, "the name of a study, or the values of a point"},
                          {{"a", "--H", "1"}, "--point N"},
                          {{"--point", "3"}, "name the study"},
                          {{"a", "--panel", "loop"}, "--point N"},
                          {{"a", "--point", "3", "--map", "fn_peak_N"}, "--map"},
                          {{"a", "--point", "3", "--on-worker"}, "--server"},
                          {{"--H", "0.5,1", "--mu", "1", "--e", "1"}, "one value per flag"},
                          {{"a", "--point", "12"}, "0 to 11", 1}}) {
    const auto outcome = plot(wrong.arguments);
    EXPECT_EQ(outcome.exit_code, wrong.exit_code) << wrong.expected << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(wrong.expected));
    EXPECT_EQ(outcome.out, "") << wrong.expected;
  }
}

TEST_F(Plot, DrawsAPointSolvedAgainAndReportsDifferencesFromTheStoredRow) {
  const auto other = plot({"a", "--point", "0"});
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_THAT(other.out, AllOf(HasSubstr("Point 0 of a"), HasSubstr("Shape of the finger")));
  EXPECT_THAT(other.err, HasSubstr("The point was solved again: differs from the stored row in "));
  EXPECT_THAT(other.err, HasSubstr("fn_peak_N"));
  EXPECT_THAT(other.out, HasSubstr("differs from the stored row in"))
      << "the plot shows the difference as well";
  const auto not_stored = plot({"a", "--point", "11"});
  EXPECT_EQ(not_stored.exit_code, 0) << not_stored.err;
  EXPECT_THAT(not_stored.err, Not(HasSubstr("stored")));

  test::run_oblique(folder_, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                              "--name", "own"});
  const auto same = plot({"own", "--point", "0"});
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.err + same.out, Not(HasSubstr("stored")));
}

TEST_F(Plot, ShowsTheShapesThatAWorkerOfTheServerSolved) {
  const test::Server server(folder_, "oblique.db");
  const test::Worker worker(folder_, server.worker_url(), {"--threads", "1", "--name", "ann"});
  const auto plot_shape = [&](const std::string& more) {
    return plot({"a", "--point", "11", "--panel", "shape", "--server", server.client_url(), more});
  };
  test::wait_until("the server has a worker",
                   [&] { return plot_shape("--on-worker").exit_code == 0; });
  const auto there = plot_shape("--on-worker");
  EXPECT_THAT(there.out, HasSubstr("at touch"));
  EXPECT_THAT(there.out, HasSubstr("at separation"));
  EXPECT_THAT(there.out, HasSubstr("drop "));
  EXPECT_THAT(there.out, Not(HasSubstr("--local")));
  const auto here = plot_shape("--local");
  EXPECT_EQ(here.out, there.out);
}

TEST_F(Plot, DrawsPanelsOfAPointThatBelongsToNoStudy) {
  const auto panel = [this](const std::string& name) {
    const auto outcome = plot({"--preset", "paper", "--H", "0.4", "--mu", "1.2", "--e", "1",
                               "--tip-mass", "0.001", "--panel", name});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  };
  EXPECT_THAT(panel("forces"),
              AllOf(HasSubstr("Contact forces"), Not(HasSubstr("Shape of the finger"))));
  EXPECT_THAT(panel("shape"), AllOf(HasSubstr("0.1 m"), HasSubstr("0.2 m"), HasSubstr("0.3 m")))
      << "shapes during the fall are missing";
  EXPECT_THAT(plot({"a", "--point", "0", "--panel", "loop", "--show"}).out,
              HasSubstr("compression"));
}

TEST(PaperFigures, AreWrittenAsFiveFilesInOneFolder) {
  const test::TemporaryFolder folder;
  const auto outcome = test::run_oblique(folder, {"paper", "--figures", "made/here"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "made" / "here")) {
    EXPECT_THAT(contents_of(entry.path()), AllOf(StartsWith("<?xml"), HasSubstr("</svg>")));
    ++files;
  }
  EXPECT_EQ(files, 5U);
  std::ofstream(folder.path() / "taken") << "x";
  const auto refused = test::run_oblique(folder, {"paper", "--figures", "taken"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--figures taken"));
}

}  // namespace
}  // namespace oblique::client
