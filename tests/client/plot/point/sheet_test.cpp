// Several figures in one picture.
#include <algorithm>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/files/figure_table.h"
#include "client/plot/point/panels.h"
#include "client/plot/sheets/sheet.h"
#include "tests/client/plot/point/history_of_tests.h"

namespace oblique::client::plot {
namespace {

using testing::HasSubstr;

std::vector<std::string> all_of(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator i(text.begin(), text.end(), expression), end; i != end; ++i) {
    found.push_back((*i)[1].str());
  }
  return found;
}

TEST(Sheet, FramesOfAllPartsHaveNamesOfTheirOwn) {
  const auto svg = svg_of(sheet_of(test::small_history(), {}), {1040.0, 1080.0});
  const auto ids = all_of(svg, " id=\"([^\"]*)\"");
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), ids.size());
  for (const auto& used : all_of(svg, "url\\(#([^)]*)\\)")) {
    EXPECT_THAT(ids, testing::Contains(used));
  }
}

TEST(Sheet, HasOneColumnWhereItIsNarrow) {
  const auto sheet = sheet_of(test::small_history(), {});
  const auto columns = [&sheet](double width) {
    const auto lefts =
        all_of(svg_of(sheet, {width, 900.0}), "<g transform=\"translate\\(([0-9.]*) ");
    return std::set<std::string>(lefts.begin(), lefts.end()).size();
  };
  EXPECT_EQ(columns(1040.0), 2U);
  EXPECT_EQ(columns(700.0), 1U);
}

TEST(Sheet, IsHigherWhereItsPartsNeedIt) {
  const auto svg = svg_of(sheet_of(test::small_history(), {}), {360.0, 300.0});
  EXPECT_GT(std::stod(all_of(svg, " height=\"([0-9.]*)\" viewBox").at(0)), 6 * 200.0);
}

TEST(Sheet, AsATableHasAllPanels) {
  const auto csv = csv_of(flattened(sheet_of(test::small_history(), {})));
  for (const char* heading :
       {"line,t_s,force_N\n", "line,minus_uy_m,fn_N\n", "line,t_s,energy_J\n", "line,x_m,y_m\n"}) {
    EXPECT_THAT(csv, HasSubstr(heading));
  }
  EXPECT_THAT(csv, HasSubstr("normal force F_n,0.0001,1000\n"));
}

TEST(Sheet, PartsThatAreHigherThanAskedForEndWhereTheNextBegins) {
  for (const double width : {320.0, 480.0, 800.0}) {
    const auto svg = svg_of(sheet_of(test::small_history(), {}), {width, 360.0});
    const std::string mark = "<g transform=\"translate(";
    std::map<double, double> lowest_texts;  // of the rows of parts, by where these begin
    for (auto at = svg.find(mark); at != std::string::npos;) {
      const auto next = svg.find(mark, at + 1);
      const std::string part = svg.substr(at, next == std::string::npos ? next : next - at);
      const double y = std::stod(all_of(part, "translate\\([0-9.]* ([0-9.]*)\\)").front());
      const std::string drawn = part.substr(0, part.find("\n</g>\n</svg>"));
      for (const auto& text : all_of(drawn, "<text [^>]* y=\"([0-9.]*)\"")) {
        lowest_texts[y] = std::max(lowest_texts[y], y + std::stod(text));
      }
      at = next;
    }
    for (auto row = lowest_texts.begin(); std::next(row) != lowest_texts.end(); ++row) {
      EXPECT_LE(row->second, std::next(row)->first) << width;
    }
  }
}

}  // namespace
}  // namespace oblique::client::plot
