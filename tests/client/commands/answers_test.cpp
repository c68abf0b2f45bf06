// How `oblique` handles valid and invalid answers of a server.
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/chunk.h"
#include "tests/client/service/scripted_server.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

/// A chunk of rows with one column, `point`.
protocol::QueryReply chunk_of(std::uint64_t number, const std::vector<std::int64_t>& points,
                              bool ends) {
  protocol::ChunkWriter rows({"point"});
  for (const std::int64_t point : points) {
    rows.integer(point);
    rows.end_row();
  }
  protocol::QueryReply chunk = rows.take();
  chunk.set_chunk(number);
  chunk.set_ends(ends);
  return chunk;
}

std::string frame_of(std::uint64_t request_id, const protocol::QueryReply& chunk) {
  protocol::ClientReply reply;
  reply.set_request_id(request_id);
  *reply.mutable_query() = chunk;
  return protocol::encode(reply);
}

/// Returns the answers of a server: two rows to a query, and the result of `more` to each request
/// for more rows.
ScriptedServer::Answer gives(
    std::function<std::vector<std::string>(std::uint64_t request_id, std::uint64_t taken)> more) {
  return [more](const protocol::ClientRequest& request) -> std::vector<std::string> {
    if (request.has_more_rows()) {
      return more(request.more_rows().request_id(), request.more_rows().received());
    }
    if (request.has_query()) {
      return {frame_of(request.request_id(), chunk_of(1, {0, 1}, false))};
    }
    return {};
  };
}

/// Returns the answers of a server with one study in the state `state`.
ScriptedServer::Answer has_study(const std::string& state) {
  return [state](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    auto& study = *reply.mutable_status()->add_studies();
    study.set_name("s");
    study.set_state(state);
    study.set_points(100);
    study.set_solved(state == "done" ? 100 : 50);
    return std::vector{protocol::encode(reply)};
  };
}

test::Outcome run_client(const ScriptedServer& server, std::vector<std::string> words) {
  words.insert(words.end(), {"--server", server.url()});
  return test::run_oblique(words);
}

TEST(Answers, PartsOfOneAnswerAreJoined) {
  const ScriptedServer server(gives([](std::uint64_t id, std::uint64_t taken) {
    return std::vector{frame_of(id, chunk_of(taken + 1, {2}, taken == 3))};
  }));
  for (const auto& words : {std::vector<std::string>{"query", "s", "--format", "csv"},
                            std::vector<std::string>{"sql", "SELECT 1", "--format", "csv"}}) {
    const auto all = run_client(server, words);
    EXPECT_EQ(all.exit_code, 0) << all.err;
    EXPECT_EQ(all.out, "point\n0\n1\n2\n2\n2\n");
  }
}

TEST(Answers, AnIncompleteAnswerGivesExitCodeOne) {
  const auto error = [](std::uint64_t id, std::uint64_t) {
    protocol::ClientReply reply;
    reply.set_request_id(id);
    reply.mutable_error()->set_message("the disk is \x1b[2J gone");
    return std::vector{protocol::encode(reply)};
  };
  const auto lacking = [](std::uint64_t id, std::uint64_t) {
    return std::vector{frame_of(id, chunk_of(3, {4, 5}, true))};
  };
  const auto unsound = [](std::uint64_t id, std::uint64_t) {
    auto chunk = chunk_of(2, {4, 5}, true);
    chunk.set_chunk_rows(1'000'000);
    return std::vector{frame_of(id, chunk)};
  };
  const auto of_more_columns = [](std::uint64_t id, std::uint64_t) {
    protocol::QueryReply wider = protocol::ChunkWriter({"point", "H"}).take();
    wider.set_chunk(2);
    wider.set_ends(true);
    return std::vector{frame_of(id, wider)};
  };
  const std::string broke_off = "the answer ended after 2 rows";
  for (const auto& [answer, expected] :
       {std::pair{gives(error), std::string("disk is \\x1b[2J gone")},
        {gives(lacking), broke_off},
        {gives(unsound), broke_off},
        {gives(of_more_columns), broke_off}}) {
    const ScriptedServer server(answer);
    const auto csv = run_client(server, {"query", "s", "--format", "csv"});
    EXPECT_EQ(csv.exit_code, 1);
    EXPECT_THAT(csv.err, testing::HasSubstr(expected));
  }
}

TEST(Answers, AnAnswerThatStopsArrivingGivesExitCodeOne) {
  const ScriptedServer server(
      gives([](std::uint64_t, std::uint64_t) { return std::vector<std::string>(); }));
  test::Outcome csv;
  do {  // runs the query again if even its first rows came after the timeout
    csv = run_client(server, {"query", "s", "--format", "csv", "--timeout", "0.2"});
  } while (csv.err.find("no answer from") != std::string::npos);
  EXPECT_EQ(csv.exit_code, 1);
  EXPECT_THAT(csv.err, testing::HasSubstr("ended after 2 rows: nothing came from"));
}

TEST(Watch, ExitsWithZeroForADoneStudyAndWithOneForACancelledStudy) {
  EXPECT_EQ(run_client(ScriptedServer(has_study("done")), {"watch", "s"}).exit_code, 0);
  const auto watch = run_client(ScriptedServer(has_study("cancelled")), {"watch", "s"});
  EXPECT_EQ(watch.exit_code, 1);
  EXPECT_THAT(watch.err, testing::HasSubstr("The study is cancelled; `oblique resume` continues"));
}

TEST(Watch, ReportsFailedPointsWithReasonsAndExitsWithOne) {
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
      protocol::ChunkWriter rows({"error", "points", "first"});
      rows.text("no \x1b[2J answer");
      rows.integer(3);
      rows.integer(4);
      rows.end_row();
      *reply.mutable_query() = rows.take();
      reply.mutable_query()->set_chunk(1);
      reply.mutable_query()->set_ends(true);
    }
    return std::vector{protocol::encode(reply)};
  });
  const auto watch = run_client(server, {"watch", "s"});
  EXPECT_EQ(watch.exit_code, 1);
  EXPECT_NE(watch.err.find("3 of 10 points failed"), std::string::npos) << watch.err;
  EXPECT_NE(watch.err.find("3 x no \\x1b[2J answer (first at point 4)"), std::string::npos)
      << watch.err;
}

constexpr const char* kControlCodes = "\x1b[2J\u009b2J\u202e\x7f";

/// Fills every text of a reply with control sequences.
std::vector<std::string> reply_of_control_codes(const protocol::ClientRequest& request) {
  auto reply = reply_to(request);
  if (request.has_status() && request.status().study() == "error") {
    reply.mutable_error()->set_message(kControlCodes);
  } else if (request.has_status()) {
    auto& study = *reply.mutable_status()->add_studies();
    study.set_name(kControlCodes);
    study.set_state(kControlCodes);
    study.set_points(10);
    study.set_created_at(kControlCodes);
    study.set_waits_for(kControlCodes);
  } else if (request.has_workers()) {
    auto& worker = *reply.mutable_workers()->add_workers();
    worker.set_name(kControlCodes);
    worker.set_instruction_set(kControlCodes);
    worker.set_solver_version(kControlCodes);
  } else if (request.has_change()) {
    reply.mutable_change()->mutable_study()->set_name(kControlCodes);
    reply.mutable_change()->mutable_study()->set_state(kControlCodes);
  } else if (request.has_query()) {
    protocol::ChunkWriter rows({kControlCodes});
    rows.text(kControlCodes);
    rows.end_row();
    *reply.mutable_query() = rows.take();
    reply.mutable_query()->set_chunk(1);
    reply.mutable_query()->set_ends(true);
  }
  return {protocol::encode(reply)};
}

TEST(ServerText, CannotSendControlCodesToTheTerminal) {
  const ScriptedServer server(reply_of_control_codes);
  const std::vector<std::vector<std::string>> all{{"status"},
                                                  {"status", "--format", "json"},
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
    const auto outcome = run_client(server, words);
    const auto output = outcome.out + outcome.err;
    const auto line = testing::PrintToString(words) + output;
    EXPECT_TRUE(output.find("\\x1b[2J") != std::string::npos ||
                output.find("\\u001b[2J") != std::string::npos)
        << line;
    for (const char* raw : {"\x1b", "\u009b", "\u202e", "\x7f"}) {
      EXPECT_EQ(output.find(raw), std::string::npos) << line;
    }
  }
}

}  // namespace
}  // namespace oblique::client
