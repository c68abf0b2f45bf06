// What the page asks of a study as bins and columns, of a whole server with a pretended worker.
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using nlohmann::json;

using PageBinsTest = PageStudyTest;

TEST_F(PageBinsTest, BinsCountEveryPointOnce) {
  submit_grid();
  solve(24);
  const Numbers bins = page_.numbers("/api/studies/1/bins?x=mu&y=H&z=fn_peak_N&nx=4&ny=3");
  EXPECT_EQ(bins.head["points"], 24);
  EXPECT_EQ(bins.read<std::uint32_t>(0, 12), std::vector<std::uint32_t>(12, 2));
  const Numbers some = page_.numbers("/api/studies/1/bins?x=mu&x0=0.1&x1=0.5&nx=2");
  EXPECT_EQ(some.head["points"], 12);
  EXPECT_EQ(some.head["outside"], 12);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/bins?x=mode")), 400);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/bins?x=mu&xlog=1&x0=0")), 400);
}

TEST_F(PageBinsTest, BothEndsThatPeopleTypeAreInTheBins) {
  submit_grid();
  solve(24);
  for (const std::string log : {"", "&xlog=1"}) {
    const std::string bins = "/api/studies/1/bins?x=mu&nx=2" + log;
    const Numbers typed =
        page_.numbers(bins + "&x0=0.2&x1=0.6");  // 0.6 / 3 is another double than 0.2
    EXPECT_EQ(typed.head["points"], 18) << log;
    EXPECT_EQ(typed.head["x"]["least"], 0.2);
    EXPECT_EQ(typed.head["x"]["most"], 0.6);
  }
  const std::string far = "/api/studies/1/bins?x=mu&x1=1e300";
  EXPECT_EQ(page_.numbers(far + "&x0=-1e300").head["points"], 24);
  EXPECT_EQ(page_.numbers("/api/studies/1/bins?x=mu&x0=-1.7e308&x1=1.7e308").head["points"], 24);
  EXPECT_EQ(page_.numbers(far + "&x0=1e-300&xlog=1").head["points"], 18);
}

TEST_F(PageBinsTest, BinsOfNothingHaveTheEndsThatWereTyped) {
  submit_grid();
  const std::string bins = "/api/studies/1/bins?x=fn_peak_N";
  EXPECT_EQ(page_.numbers(bins + "&x0=2").head["x"]["most"], 2);
  EXPECT_EQ(page_.numbers(bins + "&x1=-2").head["x"]["least"], -2);
  EXPECT_EQ(status_of_answer(page_.get(bins + "&xlog=1")), 200);
  EXPECT_EQ(status_of_answer(page_.get(bins + "&xlog=1&x0=-1&x1=1")), 400);
}

TEST_F(PageBinsTest, BinsOfAHugeStudyHaveWhatWasSolved) {
  submit("large", protocol::recipe_of(
                      {{protocol::range("H", 0.8, 1.0, 10'000),
                        protocol::range("mu", 0.0, 2.0, 100'000), protocol::listed("e", {1.0})}}));
  solve(3);
  const Numbers bins = page_.numbers("/api/studies/1/bins?x=fn_peak_N&y=mu&z=H&nx=2&ny=2");
  EXPECT_GE(bins.head["points"], 3);
  EXPECT_FLOAT_EQ(bins.head["x"]["least"], force_of(0));
  const Numbers some = page_.numbers("/api/studies/1/bins?x=mu&where=point%20%3C%202");
  EXPECT_EQ(some.head["points"], 2);
}

}  // namespace
}  // namespace oblique::server
