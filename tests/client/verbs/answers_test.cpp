// What the program makes of a server's answers, honest ones and others.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/service/scripted_server.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

/// The number behind `word` in a statement; 0 where the word is not.
int number_after(const std::string& sql, const std::string& word) {
  const auto at = sql.rfind(word);
  return at == std::string::npos ? 0 : std::stoi(sql.substr(at + word.size()));
}

/// Rows of one number, from that of `OFFSET` on, but never more than two at once.
protocol::QueryReply two_rows(const std::string& sql) {
  constexpr int kAll = 100;
  constexpr int kMost = 2;
  const int limit = number_after(sql, "LIMIT ");
  const int offset = number_after(sql, "OFFSET ");
  const int wanted = limit < 0 ? kAll - offset : std::min(limit, kAll - offset);
  protocol::QueryReply rows;
  rows.add_columns("point");
  for (int i = 0; i < std::min(wanted, kMost); ++i) {
    rows.add_rows()->add_values()->set_integer(offset + i);
  }
  rows.set_truncated(wanted > kMost);
  return rows;
}

/// A server with one study in `state`, that cuts every answer off after two rows.
ScriptedServer::Answer cuts_off(const std::string& state) {
  return [state](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    if (request.has_status()) {
      auto& study = *reply.mutable_status()->add_studies();
      study.set_name("s");
      study.set_state(state);
      study.set_points(100);
      study.set_solved(state == "done" ? 100 : 50);
    } else if (request.query().sql().find("LIMIT ") == std::string::npos) {
      reply.mutable_query()->add_columns("n");
      reply.mutable_query()->add_rows()->add_values()->set_integer(1);
      reply.mutable_query()->set_truncated(true);
    } else {
      *reply.mutable_query() = two_rows(request.query().sql());
    }
    return std::vector{protocol::encode(reply)};
  };
}

test::Outcome ask(const ScriptedServer& server, std::vector<std::string> words) {
  words.insert(words.end(), {"--server", server.url()});
  return test::run_oblique(words);
}

TEST(CutAnswers, AreAsFarAsLimitGoesPutTogetherAgain) {
  const ScriptedServer server(cuts_off("done"));
  const auto five =
      ask(server, {"query", "s", "--select", "point", "--limit", "5", "--format", "csv"});
  EXPECT_EQ(five.exit_code, 0) << five.err;
  EXPECT_EQ(five.out, "point\n0\n1\n2\n3\n4\n");
  const auto none =
      ask(server, {"query", "s", "--select", "point", "--limit", "0", "--format", "csv"});
  EXPECT_EQ(none.exit_code, 0) << none.err;
  EXPECT_EQ(none.out, "point\n");
  const auto all = ask(server, {"query", "s", "--select", "point", "--format", "csv"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(std::count(all.out.begin(), all.out.end(), '\n'), 101);
}

TEST(CutAnswers, OfAStudyThatGrowsAndOfStatementsAreShownAndEndWithOne) {
  const ScriptedServer server(cuts_off("running"));
  const auto query = ask(server, {"query", "s", "--select", "point", "--format", "csv"});
  EXPECT_EQ(query.exit_code, 1) << query.err;
  EXPECT_EQ(query.out, "point\n0\n1\n");
  EXPECT_NE(query.err.find("Only the first 2 rows"), std::string::npos) << query.err;
  const auto sql = ask(server, {"sql", "SELECT n FROM numbers", "--format", "csv"});
  EXPECT_EQ(sql.exit_code, 1) << sql.err;
  EXPECT_EQ(sql.out, "n\n1\n");
  EXPECT_NE(sql.err.find("Only the first 1 rows"), std::string::npos) << sql.err;
}

TEST(Watch, OfACancelledStudySaysSoAndEndsWithOne) {
  const ScriptedServer server(cuts_off("cancelled"));
  const auto watch = ask(server, {"watch", "s"});
  EXPECT_EQ(watch.exit_code, 1);
  EXPECT_NE(watch.err.find("The study is cancelled; oblique resume goes on"), std::string::npos)
      << watch.err;
}

TEST(Watch, OfAStudyThatIsDoneEndsWithZero) {
  const ScriptedServer server(cuts_off("done"));
  EXPECT_EQ(ask(server, {"watch", "s"}).exit_code, 0);
}

TEST(Watch, TellsHowManyPointsFailedAndWhyAndEndsWithOne) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    if (request.has_status()) {
      auto& study = *reply.mutable_status()->add_studies();
      study.set_name("s");
      study.set_state("done");
      study.set_points(10);
      study.set_solved(7);
      study.set_failed(3);
    } else {
      auto& row = *reply.mutable_query()->add_rows();
      row.add_values()->set_text("no \x1b[2J answer");
      row.add_values()->set_integer(3);
      row.add_values()->set_integer(4);
    }
    return std::vector{protocol::encode(reply)};
  });
  const auto watch = ask(server, {"watch", "s"});
  EXPECT_EQ(watch.exit_code, 1);
  EXPECT_NE(watch.err.find("3 of 10 points failed"), std::string::npos) << watch.err;
  EXPECT_NE(watch.err.find("3 x no \\x1b[2J answer (first at point 4)"), std::string::npos)
      << watch.err;
}

constexpr const char* kSteering = "\x1b[2J\u009b2J\u202e\x7f";

/// Steers with every text that a reply has.
std::vector<std::string> steering(const protocol::ClientRequest& request) {
  auto reply = reply_to(request);
  if (request.has_status() && request.status().study() == "error") {
    reply.mutable_error()->set_message(kSteering);
  } else if (request.has_status()) {
    auto& study = *reply.mutable_status()->add_studies();
    study.set_name(kSteering);
    study.set_state(kSteering);
    study.set_points(10);
    study.set_created_at(kSteering);
    study.set_waits_for(kSteering);
  } else if (request.has_workers()) {
    auto& worker = *reply.mutable_workers()->add_workers();
    worker.set_name(kSteering);
    worker.set_instruction_set(kSteering);
    worker.set_solver_version(kSteering);
  } else if (request.has_change()) {
    reply.mutable_change()->mutable_study()->set_name(kSteering);
    reply.mutable_change()->mutable_study()->set_state(kSteering);
  } else if (request.has_query()) {
    reply.mutable_query()->add_columns(kSteering);
    reply.mutable_query()->add_rows()->add_values()->set_text(kSteering);
  }
  return {protocol::encode(reply)};
}

TEST(TextsOfAServer, DoNotSteerTheTerminalWhateverTheVerb) {
  const ScriptedServer server(steering);
  const std::vector<std::vector<std::string>> all{{"status"},
                                                  {"status", "--format", "json"},
                                                  {"status", "--format", "markdown"},
                                                  {"status", "error"},
                                                  {"studies"},
                                                  {"workers"},
                                                  {"watch", "s"},
                                                  {"watch", "error"},
                                                  {"cancel", "s"},
                                                  {"pause", "s"},
                                                  {"resume", "s"},
                                                  {"retry", "s"},
                                                  {"sql", "SELECT 1"},
                                                  {"sql", "SELECT 1", "--format", "json"}};
  for (const auto& words : all) {
    const auto outcome = ask(server, words);
    const auto said = outcome.out + outcome.err;
    const auto line = testing::PrintToString(words) + said;
    EXPECT_TRUE(said.find("\\x1b[2J") != std::string::npos ||
                said.find("\\u001b[2J") != std::string::npos)
        << line;
    for (const char* raw : {"\x1b", "\u009b", "\u202e", "\x7f"}) {
      EXPECT_EQ(said.find(raw), std::string::npos) << line;
    }
  }
}

}  // namespace
}  // namespace oblique::client
