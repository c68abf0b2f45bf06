// Tests of slices and bins from a whole server with a simulated worker.
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "server/database/sqlite.h"
#include "server/query/plan.h"
#include "server/query/reader.h"
#include "server/web/answers/study_answers.h"
#include "tests/server/web/page/page_server.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST_F(PageStudyTest, ASliceComputesItsPointsFromTheRecipe) {
  solve_grid();
  const Numbers slice = slice_of("z=fn_peak_N&x=mu&y=H&at=e@1");
  EXPECT_EQ(slice.head["nx"], 4);
  EXPECT_EQ(slice.head["ny"], 3);
  EXPECT_EQ(slice.head["at"][0]["value"], 0.5);
  EXPECT_EQ(slice.head["solved"], 12);
  EXPECT_EQ(slice.read<double>(0, 4)[3], 0.6);
  EXPECT_EQ(slice.read<double>(32, 3), (std::vector<double>{1.0, 0.9, 0.8}));
  const auto values = slice.read<float>(56, 12);
  for (std::uint64_t row = 0; row < 3; ++row) {
    for (std::uint64_t column = 0; column < 4; ++column) {
      EXPECT_EQ(values[row * 4 + column], force_of(row * 8 + column * 2 + 1)) << row << column;
    }
  }
  // A slice with exchanged axes is transposed.
  const Numbers turned = slice_of("z=fn_peak_N&x=H&y=mu&at=e@1");
  EXPECT_EQ(turned.read<float>(56, 12)[1], values[4]);
  // A slice along one axis has one row.
  const Numbers line = slice_of("z=fn_peak_N&x=mu&at=H@2,e@0");
  EXPECT_EQ(line.head["ny"], 1);
  EXPECT_EQ(line.head["y"], nullptr);
  EXPECT_EQ(line.read<float>(32, 4)[3], force_of(16 + 6));
  // The server sends at most the requested number of cells.
  const Numbers few = slice_of("z=fn_peak_N&x=mu&y=H&nx=2&ny=2&x0=1&at=e@0");
  EXPECT_EQ(few.head["x"]["all_lines"], false);
  EXPECT_EQ(few.head["x"]["first"], 1);
  EXPECT_EQ(few.read<float>(32, 4),
            (std::vector<float>{force_of(2), force_of(6), force_of(18), force_of(22)}));
  const Numbers modes = slice_of("z=mode&x=mu&y=H");
  EXPECT_EQ(modes.head["dictionary"], json::parse(R"([{"text":"SC SR sR","cells":12}])"));
  EXPECT_EQ(modes.read<std::uint16_t>(56, 12), std::vector<std::uint16_t>(12, 0));
}

TEST_F(PageStudyTest, UnsolvedAndLeftOutCellsAreMarked) {
  submit("filtered", filtered_grid("mu < 0.5"));
  const Numbers slice = slice_of("z=mode&x=mu");
  EXPECT_EQ(slice.head["missing"], 3);
  EXPECT_EQ(slice.head["left_out"], 1);
  EXPECT_EQ(slice.read<std::uint16_t>(32, 4)[0], 0xffff);
  EXPECT_EQ(slice.read<std::uint16_t>(32, 4)[3], 0xfffd);
  const Numbers numbers = slice_of("z=slide_m&x=mu");
  EXPECT_EQ(numbers.read<std::uint32_t>(32, 4)[0], 0x7fc00000U);
  EXPECT_EQ(numbers.read<std::uint32_t>(32, 4)[3], 0x7fc00002U);
}

TEST_F(PageStudyTest, InADoneStudyPointsWithoutARowAreLeftOut) {
  submit("filtered", filtered_grid("mu < 0.5"));
  solve(24);
  const auto edited = open_database(page_.database(), SQLITE_OPEN_READWRITE);
  sqlite3_busy_timeout(edited.get(), 10'000);
  const std::string slice = "/api/studies/1/slice?z=mode&x=mu&y=H&at=e@0";
  EXPECT_EQ(page_.numbers(slice).head["left_out"], 3);
  execute(edited.get(), "DELETE FROM results WHERE point = 4");  // makes point 4 look left out
  EXPECT_EQ(page_.numbers(slice).head["left_out"], 4);
  EXPECT_EQ(page_.numbers(slice).head["missing"], 0);
  EXPECT_EQ(page_.json("/api/studies/1/points/4")["left_out"], true);
}

TEST_F(PageStudyTest, AStudyOfABillionPointsHasSlicesAndBins) {
  submit("huge", protocol::recipe_of(
                     {{protocol::range("H", 0.1, 1.0, 1000), protocol::range("mu", 0.0, 2.0, 1000),
                       protocol::range("e", 0.5, 1.0, 1000)}}));
  const Numbers slice = slice_of("z=mode&x=mu&y=H&nx=256&ny=256&at=e@999");
  EXPECT_EQ(slice.head["nx"], 256);
  EXPECT_EQ(slice.head["missing"], 256 * 256);
  EXPECT_EQ(bins_of("x=fn_peak_N").head["points"], 0);
  solve(3);
  const Numbers bins = bins_of("x=fn_peak_N&y=mu&z=H&nx=2&ny=2");
  EXPECT_GE(bins.head["points"], 3);
  EXPECT_FLOAT_EQ(bins.head["x"]["least"], force_of(0));
}

TEST_F(PageStudyTest, SolvedPointsAreFoundAmongManyOpenOnes) {
  submit("wide", protocol::recipe_of(
                     {{protocol::range("H", 0.1, 1.0, 40), protocol::range("mu", 0.0, 2.0, 40),
                       protocol::range("e", 0.5, 1.0, 40)}}));
  solve(200);
  std::set<std::uint64_t> solved;  // may be more than 200, because batches are solved completely
  const json stored = page_.json("/api/studies/1/rows?select=point&limit=64000");
  for (const json& row : stored["rows"]) {
    solved.insert(row[0].get<std::uint64_t>());
  }
  EXPECT_GE(solved.size(), 200U);
  EXPECT_LT(solved.size(), 60'000U);
  for (const std::string view : {"x=e&y=mu&at=H@0", "x=mu&y=e&at=H@0", "x=e&y=mu&at=H@1",
                                 "x=mu&y=H&at=e@7", "x=e&at=mu@4,H@0", "x=e&at=mu@5,H@0"}) {
    const Numbers slice = slice_of("z=fn_peak_N&" + view);
    const auto nx = slice.head["nx"].get<std::size_t>();
    const auto ny = slice.head["ny"].get<std::size_t>();
    const bool is_line = slice.head["y"].is_null();
    const auto values = slice.read<float>(8 * (nx + (is_line ? 0 : ny)), nx * ny);
    const auto first = slice.head["first_point"].get<std::uint64_t>();
    const auto x = slice.head["x"]["stride"].get<std::uint64_t>();
    const auto y = is_line ? 0 : slice.head["y"]["stride"].get<std::uint64_t>();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::uint64_t point = first + i % nx * x + i / nx * y;
      EXPECT_EQ(std::isfinite(values[i]), solved.contains(point)) << view << ' ' << point;
      EXPECT_TRUE(!solved.contains(point) || values[i] == force_of(point)) << view << ' ' << point;
    }
    const auto with = [&](const std::string& where) {
      return slice_of("z=mode&" + view + "&where=" + where).head;
    };
    EXPECT_EQ(with("fn_peak_N%20%3E%200")["solved"], slice.head["solved"]) << view;
    EXPECT_EQ(with("fn_peak_N%20%3C%200")["filtered"], slice.head["solved"]) << view;
    const json some = with("point%20%25%202%20%3D%201");
    EXPECT_EQ(some["solved"].get<int>() + some["filtered"].get<int>(), slice.head["solved"]);
  }
}

TEST_F(PageStudyTest, ErrorsOfWrongRequestsNameWhatIsAllowed) {
  submit_grid();
  for (const std::string query :
       {"z=muu&x=mu", "z=peaks&x=mu", "z=mode", "z=mode&x=mu&y=mu", "z=mode&x=k",
        "z=mode&x=mu&nx=0", "z=mode&x=mu&nx=257", "z=mode&x=mu&x0=4", "z=mode&x=mu&at=e",
        "z=mode&x=mu&at=q@1", "z=mode&x=mu&at=e@2", "z=mode&x=mu&at=e@x", "z=mode&x=mu&block=1",
        "z=mode&x=mu&at=,"}) {
    const std::string answer = page_.get("/api/studies/1/slice?" + query);
    EXPECT_EQ(status_of_answer(answer), 400) << query;
    EXPECT_TRUE(json::parse(body_of(answer)).contains("error")) << query;
  }
}

// ---- Bins ---------------------------------------------------------------------------------------

TEST_F(PageStudyTest, BinsCountEveryPointOnce) {
  solve_grid();
  const Numbers bins = bins_of("x=mu&y=H&z=fn_peak_N&nx=4&ny=3");
  EXPECT_EQ(bins.head["points"], 24);
  EXPECT_EQ(bins.read<std::uint32_t>(0, 12), std::vector<std::uint32_t>(12, 2));
  const Numbers some = bins_of("x=mu&x0=0.1&x1=0.5&nx=2");
  EXPECT_EQ(some.head["points"], 12);
  EXPECT_EQ(some.head["outside"], 12);
  const Numbers met = bins_of("x=mu&nx=2&where=mu%20%3C%200.3");
  EXPECT_EQ(met.head["points"], 12);
  EXPECT_EQ(met.head["x"]["most"], 0.2) << "the range spans only points that meet the condition";
  EXPECT_EQ(met.read<std::uint32_t>(0, 2), (std::vector<std::uint32_t>{6, 6}));
  EXPECT_EQ(bins_of("x=mu&nx=2&where=0").head["points"], 0);
  EXPECT_EQ(page_.status("/api/studies/1/bins?x=mode"), 400);
  EXPECT_EQ(page_.status("/api/studies/1/bins?x=mu&xlog=1&x0=0"), 400);
}

TEST_F(PageStudyTest, BinsIncludeTheRequestedEnds) {
  solve_grid();
  const std::string bins = "/api/studies/1/bins?x=mu&nx=2&";
  for (const std::string log : {"", "&xlog=1"}) {
    const Numbers typed = page_.numbers(bins + "x0=0.2&x1=0.6" + log);
    EXPECT_EQ(typed.head["points"], 18) << log << ": 0.6 / 3 differs from 0.2 by rounding";
    EXPECT_EQ(typed.head["x"]["least"], 0.2);
    EXPECT_EQ(typed.head["x"]["most"], 0.6);
  }
  EXPECT_EQ(page_.numbers(bins + "x0=-1e300&x1=1e300").head["points"], 24);
  EXPECT_EQ(page_.numbers(bins + "x0=-1.7e308&x1=1.7e308").head["points"], 24);
  EXPECT_EQ(page_.numbers(bins + "x0=1e-300&x1=1e300&xlog=1").head["points"], 18);
}

TEST_F(PageStudyTest, BinsWithoutPointsHaveTheRequestedEnds) {
  submit_grid();
  const std::string bins = "/api/studies/1/bins?x=fn_peak_N";
  EXPECT_EQ(page_.numbers(bins + "&x0=2").head["x"]["most"], 2);
  EXPECT_EQ(page_.numbers(bins + "&x1=-2").head["x"]["least"], -2);
  EXPECT_EQ(page_.status(bins + "&xlog=1"), 200);
  EXPECT_EQ(page_.status(bins + "&xlog=1&x0=-1&x1=1"), 400);
}

// ---- Conditions ---------------------------------------------------------------------------------

TEST_F(PageStudyTest, ASliceMarksCellsThatDoNotMeetACondition) {
  solve_grid();
  const std::string slice = "/api/studies/1/slice?x=mu&y=H&at=e@1&z=";
  const Numbers some =
      page_.numbers(slice + "fn_peak_N&where=point%20%3E%203%20AND%20fn_peak_N%20%3C%20140000");
  EXPECT_EQ(some.head["filtered"], 7);  // points 1, 3, ..., 23 except 5, 7, ..., 13
  EXPECT_EQ(some.head["solved"], 5);
  const auto bits = some.read<std::uint32_t>(56, 12);
  EXPECT_EQ(bits[1], 0x7fc00004U);
  EXPECT_EQ(std::bit_cast<float>(bits[2]), force_of(5));
  const Numbers modes = page_.numbers(slice + "mode&where=mu%20%3C%200.3");
  EXPECT_EQ(modes.read<std::uint16_t>(56, 4), (std::vector<std::uint16_t>{0, 0, 0xfffb, 0xfffb}));
  EXPECT_EQ(modes.head["dictionary"][0]["cells"], 6);
  const json part = page_.numbers(slice + "mode&x0=1&x1=2&y0=2&where=mu%20%3C%200.3").head;
  EXPECT_EQ(part["solved"], 1);
  EXPECT_EQ(part["filtered"], 1);
  EXPECT_EQ(page_.numbers(slice + "mode").head["filtered"], 0);
  EXPECT_EQ(page_.numbers(slice + "mode&where=1").head["filtered"], 0);
  EXPECT_EQ(page_.numbers(slice + "mode&where=NULL").head["filtered"], 12);
}

TEST_F(PageStudyTest, UnsolvedCellsAreNotMarkedByACondition) {
  submit_grid();
  solve(4);
  const std::string slice = "/api/studies/1/slice?x=mu&y=H&z=mode&where=mu%20%3E%200.1";
  EXPECT_EQ(page_.numbers(slice).head["filtered"], 1);
  EXPECT_EQ(page_.numbers(slice).head["missing"], 10);
  solve(20);
  EXPECT_EQ(page_.numbers(slice).head["filtered"], 3);
  EXPECT_EQ(page_.numbers(slice).head["solved"], 9);
}

TEST_F(PageStudyTest, AConditionFollowsTheQueryLanguage) {
  solve_grid();
  const std::vector<std::pair<std::string, std::string>> all{
      {"muu%20%3E%201", "did you mean `mu`?"},
      {"mu%20%3E", "\\\"mu >\\\" is not allowed: incomplete input"},
      {"1)%20OR%20(1", "is not allowed"},
      {"load_extension('x')", "load_extension"}};
  for (const std::string picture : {"slice?z=mode&x=mu&y=H&at=e@1", "bins?x=mu"}) {
    for (const auto& [condition, sentence] : all) {
      const std::string answer = page_.get("/api/studies/1/" + picture + "&where=" + condition);
      EXPECT_EQ(status_of_answer(answer), 400) << picture << condition;
      EXPECT_THAT(answer, HasSubstr(sentence)) << picture;
      EXPECT_THAT(answer, testing::Not(HasSubstr("e = 0")))
          << "the error must not contain the server's own condition";
    }
    EXPECT_EQ(page_.status("/api/studies/9/" + picture + "&where=1"), 404);
  }
  // An unknown output is an error even if the condition is valid.
  EXPECT_EQ(page_.status("/api/studies/1/slice?z=muu&x=mu&where=1"), 400);
  EXPECT_EQ(page_.status("/api/studies/1/bins?x=mode&where=1"), 400);
}

/// Returns the query for a slice of the study `grid`.
protocol::StudyQuery slice_query(const Fields& fields, const protocol::Recipe& recipe) {
  ServiceClient client;
  const PendingAnswer pending = slice_answer(client, 1, fields);
  while (true) {
    ClientRequest request;
    EXPECT_TRUE(protocol::decode(client.take().at(0), request));
    if (request.has_query()) {
      return request.query().question();
    }
    ClientReply reply;
    reply.set_request_id(request.request_id());
    if (request.has_status()) {
      reply.mutable_status()->add_studies()->set_name("grid");
    } else {
      *reply.mutable_describe()->mutable_recipe() = recipe;
    }
    client.put(protocol::encode(reply));
    EXPECT_FALSE(pending());
  }
}

TEST_F(PageStudyTest, TheRowsOfASliceAreLookedUpByKey) {
  submit_grid();
  const protocol::StudyQuery query =
      slice_query({{"z", "fn_peak_N"}, {"x", "mu"}, {"y", "H"}, {"where", "slide_m > 1 OR e > 2"}},
                  grid_recipe());
  const auto database = open_database(page_.database(), SQLITE_OPEN_READWRITE);
  restrict_to_reading(database.get());
  const std::string statement = plan(database.get(), query).sql;
  sqlite3_set_authorizer(database.get(), nullptr, nullptr);
  Statement explained(database.get(), "EXPLAIN QUERY PLAN " + statement);
  std::string steps;
  while (explained.step()) {
    steps += explained.text(3) + '\n';
  }
  EXPECT_THAT(steps, HasSubstr("(study_id=? AND point=?)")) << statement;
}

}  // namespace
}  // namespace oblique::server
