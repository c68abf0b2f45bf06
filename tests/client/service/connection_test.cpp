#include "client/service/connection.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/io/console.h"
#include "client/service/watching.h"
#include "proto/frames.h"
#include "proto/program/process.h"
#include "tests/client/service/scripted_server.h"
#include "tests/support/reserved_port.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

ConnectionSettings at(const std::string& url, std::int64_t timeout_ms) {
  return {.server_url = url, .timeout_ms = timeout_ms};
}

constexpr std::int64_t kLong_ms = 600'000;

TEST(Connection, WithoutAnAnswerNamesTheAddressAndTheRemedy) {
  const oblique::test::ReservedPort nobody;
  const auto url = nobody.url();
  Connection connection(at(url, 100));
  try {
    connection.full_status();
    FAIL();
  } catch (const ConnectionError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("no answer from " + url + " within 0.1 s"), std::string::npos)
        << message;
    EXPECT_NE(message.find("oblique-server"), std::string::npos) << message;
    EXPECT_NE(message.find("--server"), std::string::npos) << message;
  }
  Connection own({.server_url = url, .timeout_ms = 100, .if_silent = "its database is slow"});
  try {
    own.full_status();
    FAIL();
  } catch (const ConnectionError& error) {
    EXPECT_EQ(error.what(), "no answer from " + url + " within 0.1 s: its database is slow");
  }
}

TEST(Connection, RefusesAnInvalidAddress) {
  EXPECT_THROW(Connection(at("localhost", 100)), solver::InputError);
}

TEST(Connection, StopsWaitingWhenKeepWaitingReturnsFalse) {
  const oblique::test::ReservedPort nobody;
  int calls = 0;
  Connection connection(at(nobody.url(), kLong_ms), [&calls] { return ++calls < 3; });
  EXPECT_THROW(connection.workers(), Interrupted);
}

TEST(Connection, SendsTheStudyAndReadsTheReply) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    EXPECT_EQ(request.protocol_version(), protocol::kProtocolVersion);
    EXPECT_EQ(request.submit().name(), "sweep");
    reply.mutable_submit()->set_points(7);
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  EXPECT_EQ(connection.submit({.name = "sweep", .recipe = {}}).points(), 7U);
}

TEST(Connection, ThrowsTheServersErrors) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    reply.mutable_error()->set_message("no study called \"x\"");
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  try {
    connection.change("x", protocol::STUDY_CHANGE_CANCEL);
    FAIL();
  } catch (const ServerError& error) {
    EXPECT_STREQ(error.what(), "no study called \"x\"");
  }
}

TEST(Connection, TheCodeOfAnErrorTellsWrongUsageFromFailure) {
  protocol::ErrorCode code{};
  const ScriptedServer server([&code](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    reply.mutable_error()->set_message("a sentence");
    reply.mutable_error()->set_code(code);
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  const auto call = [&](protocol::ErrorCode next) {
    code = next;
    connection.describe("x");
  };
  EXPECT_THROW(call(protocol::ERROR_CODE_FAILED), ServerError);
  EXPECT_THROW(call(protocol::ERROR_CODE_NO_SUCH_STUDY), ServerError);
  EXPECT_THROW(call(protocol::ERROR_CODE_WRONG_REQUEST), solver::InputError);
}

/// A reply to a status request that reports `workers` workers.
std::vector<std::string> workers_reply(const protocol::ClientRequest& request,
                                       std::uint32_t workers) {
  auto reply = reply_to(request);
  reply.mutable_status()->set_workers(workers);
  return {protocol::encode(reply)};
}

TEST(Connection, SendsARequestAgainIfTheServerDied) {
  const oblique::test::ReservedPort port;
  std::atomic<std::uint64_t> taken{0};
  auto server = std::make_unique<ScriptedServer>(
      [&](const protocol::ClientRequest& request) {
        taken = request.request_id();
        return std::vector<std::string>();
      },
      port.url());
  bool is_second = false;
  const auto replace_when_taken = [&] {
    if (!is_second && taken != 0) {
      is_second = true;
      server.reset();
      server = std::make_unique<ScriptedServer>(
          [&](const protocol::ClientRequest& request) {
            EXPECT_EQ(request.request_id(), taken);
            return workers_reply(request, 3);
          },
          port.url());
    }
    return true;
  };
  // The timeouts are longer than this test, so only a new connection causes the client to send the
  // request again.
  Connection connection(
      {.server_url = port.url(), .timeout_ms = kLong_ms, .resend_after_ms = kLong_ms},
      replace_when_taken);
  EXPECT_EQ(connection.full_status().workers(), 3U);
}

TEST(Connection, SendsARequestAgainOverASilentConnection) {
  std::vector<std::uint64_t> ids;
  std::mutex mutex;
  const ScriptedServer server([&](const protocol::ClientRequest& request) {
    const std::lock_guard lock(mutex);
    ids.push_back(request.request_id());
    return ids.size() < 3 ? std::vector<std::string>() : workers_reply(request, 4);
  });
  Connection connection({.server_url = server.url(), .timeout_ms = kLong_ms, .resend_after_ms = 1});
  EXPECT_EQ(connection.full_status().workers(), 4U);
  const std::lock_guard lock(mutex);
  EXPECT_GE(ids.size(), 3U);
  EXPECT_EQ(ids, std::vector<std::uint64_t>(ids.size(), ids.front()));
}

TEST(Connection, SendsARequestOnceAndIgnoresARepeatedAnswer) {
  std::atomic<unsigned> requests{0};
  const ScriptedServer server([&](const protocol::ClientRequest& request) {
    auto replies = workers_reply(request, ++requests);
    replies.push_back(replies.front());
    return replies;
  });
  Connection connection(
      {.server_url = server.url(), .timeout_ms = kLong_ms, .resend_after_ms = kLong_ms});
  for (unsigned i = 1; i <= 20; ++i) {
    EXPECT_EQ(connection.full_status().workers(), i);
    EXPECT_EQ(requests, i);
  }
}

TEST(Connection, ReportsSilenceAndTheNextAnswer) {
  const oblique::test::ReservedPort port;
  std::unique_ptr<ScriptedServer> server;
  std::vector<std::string> sentences;
  const Tell tell = [&](const std::string& sentence) {
    sentences.push_back(sentence);
    if (server == nullptr) {
      server = std::make_unique<ScriptedServer>(
          [](const protocol::ClientRequest& request) {
            auto reply = reply_to(request);
            reply.mutable_status()->add_studies()->set_points(5);
            return std::vector{protocol::encode(reply)};
          },
          port.url());
    }
  };
  // The timeout of 10 ms ends before the server starts.
  Connection connection(at(port.url(), 10));
  EXPECT_EQ(connection.status("", tell).at(0).points(), 5U);
  ASSERT_EQ(sentences.size(), 2U);
  EXPECT_NE(sentences[0].find("no answer from " + port.url()), std::string::npos) << sentences[0];
  EXPECT_NE(sentences[1].find("answers again"), std::string::npos) << sentences[1];
}

TEST(WatchStudy, SaysThatTheServerIsAwayAlsoIfOnlyErrorsArePrinted) {
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err);
  console.set_verbosity(Verbosity::kQuiet);
  protocol::StopSignals stop;
  const auto ask = [](const Tell& tell) {
    tell("no answer from tcp://x: waiting for it");
    protocol::StudyStatus status;
    status.set_state("done");
    return status;
  };
  watch_study(console, ask, stop);
  EXPECT_EQ(err.str(), "no answer from tcp://x: waiting for it\n");
}

/// The message StillWorking, which a server sends while a query waits or runs.
std::string still_working(const protocol::ClientRequest& request, bool runs) {
  protocol::ClientReply word;
  word.set_request_id(request.request_id());
  word.mutable_still_working()->set_runs(runs);
  return protocol::encode(word);
}

TEST(Connection, ReportsAQueryThatTheServerHasNotFinishedInTime) {
  for (const bool runs : {true, false}) {
    const ScriptedServer server([runs](const protocol::ClientRequest& request) {
      EXPECT_EQ(request.query().time_limit_ms(), 500U);
      return std::vector{still_working(request, runs)};
    });
    std::string message;
    do {  // sends the query again if even StillWorking came after the timeout
      Connection connection(at(server.url(), 500));
      try {
        connection.query("SELECT 1");
        FAIL();
      } catch (const ConnectionError& error) {
        message = error.what();
      }
    } while (message.starts_with("no answer from"));
    EXPECT_NE(message.find("the query took too long: after 0.5 s"), std::string::npos) << message;
    EXPECT_NE(message.find(runs ? "is still working on it" : "queries of others"),
              std::string::npos)
        << message;
    EXPECT_NE(message.find("--timeout"), std::string::npos) << message;
  }
}

TEST(Connection, ReturnsTheAnswerAfterStillWorking) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    protocol::ClientRequest another = request;
    another.set_request_id(request.request_id() + 1);
    auto reply = reply_to(request);
    reply.mutable_query()->add_columns("a");
    reply.mutable_query()->set_chunk(1);
    reply.mutable_query()->set_ends(true);
    return std::vector{still_working(another, true), still_working(request, false),
                       still_working(request, true), protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  EXPECT_EQ(connection.query("SELECT 1").columns.at(0), "a");
}

TEST(Connection, RequestsEveryPageOfALongListAndStopsAtARepeatedPage) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    auto reply = reply_to(request);
    const std::uint64_t after = request.status().after_study_id();
    reply.mutable_status()->add_studies()->set_study_id(after + 10);
    reply.mutable_status()->set_workers(3);
    reply.mutable_status()->set_next_after(after < 30 ? after + 10 : 5);
    return std::vector{protocol::encode(reply)};
  });
  Connection connection(at(server.url(), kLong_ms));
  const auto all = connection.full_status();
  ASSERT_EQ(all.studies_size(), 4);
  EXPECT_EQ(all.studies(3).study_id(), 40U);
  EXPECT_EQ(all.workers(), 3U);
}

TEST(Connection, RecognisesAServerOfAnotherProgram) {
  const ScriptedServer server(
      [](const protocol::ClientRequest&) { return std::vector<std::string>{"HTTP/1.1 400"}; });
  Connection connection(at(server.url(), kLong_ms));
  try {
    connection.query("SELECT 1");
    FAIL();
  } catch (const ConnectionError& error) {
    EXPECT_NE(std::string(error.what()).find("is not that of an oblique-server"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace oblique::client
