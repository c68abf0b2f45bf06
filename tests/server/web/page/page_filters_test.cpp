// Pictures of the points that meet a condition, of a whole server with a pretended worker.
#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "server/query/plan.h"
#include "server/query/reader.h"
#include "server/web/answers/study_answers.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;

using PageFiltersTest = PageStudyTest;

TEST_F(PageFiltersTest, ASliceMarksWhatDoesNotMeetACondition) {
  submit_grid();
  solve(24);
  const std::string slice = "/api/studies/1/slice?x=mu&y=H&at=e@1&z=";
  const Numbers some =
      page_.numbers(slice + "fn_peak_N&where=point%20%3E%203%20AND%20fn_peak_N%20%3C%20140000");
  EXPECT_EQ(some.head["filtered"], 7);  // of 1, 3, ..., 23 all but 5, 7, ..., 13
  EXPECT_EQ(some.head["solved"], 5);
  const auto bits = some.read<std::uint32_t>(56, 12);
  EXPECT_EQ(bits[1], 0x7fc00004U);
  EXPECT_EQ(std::bit_cast<float>(bits[2]), force_of(5));
  const Numbers modes = page_.numbers(slice + "mode&where=mu%20%3C%200.3");
  EXPECT_EQ(modes.read<std::uint16_t>(56, 4), (std::vector<std::uint16_t>{0, 0, 0xfffb, 0xfffb}));
  EXPECT_EQ(modes.head["dictionary"][0]["cells"], 6);
  EXPECT_EQ(page_.numbers(slice + "mode").head["filtered"], 0);
  EXPECT_EQ(page_.numbers(slice + "mode&where=1").head["filtered"], 0);
  EXPECT_EQ(page_.numbers(slice + "mode&where=NULL").head["filtered"], 12);
}

TEST_F(PageFiltersTest, SlicesOfAllHeldValuesAreJudgedAlike) {
  submit_grid();
  solve(24);
  for (const std::string view : {"x=mu&y=H&at=e@0", "x=mu&at=H@1,e@1", "x=e&at=H@2,mu@3",
                                 "x=mu&y=e&at=H@0", "x=mu&y=H&x0=1&x1=2&y0=2", "x=H&y=e&at=mu@2"}) {
    const std::string slice = "/api/studies/1/slice?z=mode&" + view;
    const auto cells = page_.numbers(slice).head["solved"].get<int>();
    const json all = page_.numbers(slice + "&where=fn_peak_N%20%3E%200").head;
    EXPECT_EQ(all["solved"], cells) << view;
    const json none = page_.numbers(slice + "&where=fn_peak_N%20%3C%200").head;
    EXPECT_EQ(none["filtered"], cells) << view;
    const json some = page_.numbers(slice + "&where=point%20%25%202%20%3D%201").head;
    EXPECT_EQ(some["solved"].get<int>() + some["filtered"].get<int>(), cells) << view;
  }
}

TEST_F(PageFiltersTest, WhatWasNotSolvedIsNotLeftOutByACondition) {
  submit_grid();
  solve(4);
  const std::string slice = "/api/studies/1/slice?x=mu&y=H&z=mode&where=mu%20%3E%200.1";
  EXPECT_EQ(page_.numbers(slice).head["filtered"], 1);
  EXPECT_EQ(page_.numbers(slice).head["missing"], 10);
  solve(20);
  EXPECT_EQ(page_.numbers(slice).head["filtered"], 3);
  EXPECT_EQ(page_.numbers(slice).head["solved"], 9);
}

TEST_F(PageFiltersTest, BinsCountWhatMeetsACondition) {
  submit_grid();
  solve(24);
  const Numbers bins = page_.numbers("/api/studies/1/bins?x=mu&nx=2&where=mu%20%3C%200.3");
  EXPECT_EQ(bins.head["points"], 12);
  EXPECT_EQ(bins.head["x"]["most"], 0.2);  // of those that are counted
  EXPECT_EQ(bins.read<std::uint32_t>(0, 2), (std::vector<std::uint32_t>{6, 6}));
  const Numbers none = page_.numbers("/api/studies/1/bins?x=mu&nx=2&where=0");
  EXPECT_EQ(none.head["points"], 0);
}

TEST_F(PageFiltersTest, AConditionIsJudgedAsTheQueryLanguageDoes) {
  submit_grid();
  solve(24);
  const std::vector<std::pair<std::string, std::string>> all{
      {"muu%20%3E%201", "did you mean `mu`?"},
      {"mu%20%3E", "\\\"mu >\\\" is not allowed: incomplete input"},
      {"1)%20OR%20(1", "is not allowed"},
      {"1;%20DROP%20TABLE%20studies", "is not allowed"},
      {"1%20--", "is not allowed"},
      {"E%20=%201", "E"},
      {"load_extension('x')", "load_extension"}};
  for (const std::string picture : {"slice?z=mode&x=mu&y=H&at=e@1", "bins?x=mu"}) {
    for (const auto& [condition, sentence] : all) {
      const std::string answer = page_.get("/api/studies/1/" + picture + "&where=" + condition);
      EXPECT_EQ(status_of_answer(answer), 400) << picture << condition;
      EXPECT_THAT(answer, HasSubstr(sentence)) << picture;
      EXPECT_THAT(answer, testing::Not(HasSubstr("e = 0"))) << "not what was added to it";
    }
    EXPECT_EQ(status_of_answer(page_.get("/api/studies/9/" + picture + "&where=1")), 404);
  }
  // What is wrong beside it is told before anything is looked for.
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/slice?z=muu&x=mu&where=1")), 400);
  EXPECT_EQ(status_of_answer(page_.get("/api/studies/1/bins?x=mode&where=1")), 400);
}

/// The query by which a slice of the study `grid` is read.
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

TEST_F(PageFiltersTest, TheRowsOfASliceAreLookedUpByKey) {
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
