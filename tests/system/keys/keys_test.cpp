// The server admits peers with a listed key. It refuses all others at once, and both sides report
// the reason.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A server with keys, and folders with keys that the server does not list.
class KeysTest : public ::testing::Test {
 protected:
  KeysTest() {
    EXPECT_EQ(run_oblique(folder_, {"keygen", keys_}).exit_code, 0);
    server_ = std::make_unique<Server>(folder_, folder_.file("keys.db"),
                                       Environment{{"OBLIQUE_KEYS", key("server")}});
  }

  std::string key(const std::string& name) const { return keys_ + "/" + name + ".key"; }

  Outcome run_client(std::vector<std::string> arguments, const std::string& key_file = "") const {
    arguments.insert(arguments.end(), {"--server", server_->client_url()});
    if (!key_file.empty()) {
      arguments.insert(arguments.end(), {"--keys", key_file});
    }
    return run_oblique(folder_, arguments);
  }
  Outcome change_keys(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "keys");
    arguments.insert(arguments.end(), {"--dir", keys_});
    return run_oblique(folder_, arguments);
  }
  std::unique_ptr<Worker> worker_with(const std::string& key_file) const {
    return std::make_unique<Worker>(folder_, server_->worker_url(),
                                    std::vector<std::string>{"--threads", "1", "--keys", key_file});
  }
  static void wait_until_printed(const Process& process, const std::string& words) {
    wait_until("the message " + words,
               [&] { return process.err().find(words) != std::string::npos; });
  }
  /// Expects that a client with `key_file` is refused and prints a message with `words`.
  void expect_client_error(const std::string& key_file, const std::string& words) const {
    const Outcome outcome = run_client({"status"}, key_file);
    EXPECT_EQ(outcome.exit_code, 1) << key_file;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_THAT(outcome.err, Not(HasSubstr("no answer")));
  }

  TemporaryFolder folder_;
  std::string keys_ = folder_.file("keys");
  std::unique_ptr<Server> server_;
};

const std::vector<std::string> kFewPoints{"submit", "--name", "few", "--preset", "paper",     "--H",
                                          "1",      "--mu",   "0.4", "--e",      "0.9,0.95,1"};

TEST_F(KeysTest, WithTheKeysOfTheirRolesAStudyIsSubmittedSolvedAndRead) {
  const auto worker = worker_with(key("worker"));
  auto submit = kFewPoints;
  submit.emplace_back("--watch");
  EXPECT_EQ(run_client(submit, key("client")).exit_code, 0);
  const Outcome read = run_client({"query", "few", "--select", "mu,e,status"}, key("reader"));
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_THAT(read.out, HasSubstr("solved"));
  EXPECT_THAT(run_client({"status", "--format", "json"}, key("reader")).out,
              HasSubstr(R"("submitted_by":"client","access":"keys")"));
  auto another = kFewPoints;
  another[2] = "another";
  const Outcome refused = run_client(another, key("reader"));
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("has the role reader"));
}

TEST_F(KeysTest, ARefusedClientReportsTheReasonAndItsKey) {
  expect_client_error("", "requires a key, and none was given");
  expect_client_error(key("worker"), "it is for workers, and this port is for clients");
  const std::string others = folder_.file("others");
  ASSERT_EQ(run_oblique(folder_, {"keygen", others}).exit_code, 0);
  expect_client_error(others + "/client.key", "the server's public key in that file is wrong");
  ASSERT_EQ(change_keys({"add", "gone", "--role", "client"}).exit_code, 0);
  wait_until_printed(server_->process(), "new: gone");
  ASSERT_EQ(change_keys({"revoke", "gone"}).exit_code, 0);
  wait_until_printed(server_->process(), "revoked: gone");
  expect_client_error(key("gone"), "not in the server's list");
  wait_until_printed(server_->process(), "has the role worker, but this port is for clients");
  wait_until_printed(server_->process(), "another public key of the server");
  const Outcome seen = run_client({"workers"}, key("reader"));
  EXPECT_THAT(seen.err, AllOf(HasSubstr("refused since the server started: "),
                              HasSubstr("key of another role (1)")));
  EXPECT_EQ(run_client({"status"}, key("server")).exit_code, 2)
      << "a client must not use the server's key";
}

TEST_F(KeysTest, AValidKeyAtTheWrongPortIsRefusedWithAHint) {
  const Outcome outcome =
      run_oblique(folder_, {"status", "--server", server_->worker_url(), "--keys", key("client")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("or this is not its port for clients (by default 7600)"),
                                 HasSubstr(key("client"))));
  const Worker worker(folder_, server_->client_url(), {"--keys", key("worker")});
  wait_until_printed(worker, "or this is not its port for workers (by default 7601)");
}

TEST_F(KeysTest, AServerWithAClientsKeyNamesTheVariableForItsOwnKey) {
  Process server(folder_, server_program(),
                 {"--db", folder_.file("a.db"), "--worker-port", "0", "--client-port", "0"},
                 Environment{{"OBLIQUE_KEYS", key("client")}});
  EXPECT_NE(server.wait(), 0);
  EXPECT_THAT(server.err(),
              AllOf(HasSubstr(key("client")),
                    HasSubstr("--keys or OBLIQUE_SERVER_KEYS, which override OBLIQUE_KEYS")));
}

TEST_F(KeysTest, AKeyFileReadableByOthersIsWrongUsageAndTheMessageHasTheRemedy) {
  std::filesystem::permissions(key("client"), std::filesystem::perms(0644));
  const Outcome outcome = run_client({"status"}, key("client"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("chmod 600 '" + key("client") + "'"));
}

TEST_F(KeysTest, AServerWithoutKeysIsReportedToPeersWithKeys) {
  const Server open(folder_, folder_.file("open.db"));
  const Outcome outcome =
      run_oblique(folder_, {"status", "--server", open.client_url(), "--keys", key("client")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("has no keys"));
  const Worker worker(folder_, open.worker_url(), {"--keys", key("worker")});
  wait_until_printed(worker, "has no keys");
}

TEST_F(KeysTest, ARefusedWorkerReportsTheReasonAndRetriesSlowly) {
  const auto client = worker_with(key("client"));
  wait_until_printed(*client,
                     "it is for clients, and this port is for workers: trying again in 2 s");
  const Worker keyless(folder_, server_->worker_url());
  wait_until_printed(keyless, "requires a key, and none was given");
  wait_until_printed(*client, "trying again in 4 s");
}

TEST_F(KeysTest, AWorkerJoinsWhenItsKeyIsAddedAndLeavesWhenItIsRevoked) {
  ASSERT_EQ(change_keys({"add", "late", "--role", "worker"}).exit_code, 0);
  const Outcome listed = change_keys({"list", "--format", "csv"});
  const std::size_t at = listed.out.find("late,worker,");
  ASSERT_NE(at, std::string::npos) << listed.out;
  ASSERT_EQ(change_keys({"revoke", "late"}).exit_code, 0);
  EXPECT_THAT(change_keys({"list"}).out, Not(HasSubstr("late")));
  const auto worker = worker_with(key("late"));
  wait_until_printed(*worker, "did not accept this key");
  // `keys add --public` adds the public key of the file `late` to the list again.
  std::string line;
  std::ifstream file(key("late"));
  while (std::getline(file, line) && !line.starts_with("public = \"")) {
  }
  const std::string public_key = line.substr(10, 40);
  ASSERT_EQ(change_keys({"add", "late", "--role", "worker", "--public", public_key}).exit_code, 0);
  wait_until_printed(*worker, "welcomed as worker");
  ASSERT_EQ(change_keys({"revoke", "late"}).exit_code, 0);
  wait_until_printed(server_->process(), "revoked: late");
  wait_until("the worker reports the refusal", [&] {
    const std::string output = worker->err();
    return output.find("did not accept this key", output.find("welcomed as worker")) !=
           std::string::npos;
  });
}

TEST_F(KeysTest, AWatchingClientReportsThatItsKeyIsRevoked) {
  ASSERT_EQ(run_client(kFewPoints, key("client")).exit_code, 0);
  Process watching(folder_, client_program(),
                   {"watch", "few", "--server", server_->client_url(), "--keys", key("reader")});
  wait_until_printed(watching, "waits for a worker");
  ASSERT_EQ(change_keys({"revoke", "reader"}).exit_code, 0);
  EXPECT_EQ(watching.wait(), 1);
  EXPECT_THAT(watching.err(), HasSubstr("is not in the server's list"));
}

TEST_F(KeysTest, AFailedChangeLeavesTheListUnchanged) {
  const std::string before = change_keys({"list", "--format", "csv"}).out;
  EXPECT_EQ(change_keys({"add", "x", "--role", "server"}).exit_code, 2);
  EXPECT_EQ(change_keys({"add", "x", "--role", "worker", "--public", "short"}).exit_code, 2);
  EXPECT_EQ(change_keys({"add", "worker", "--role", "client"}).exit_code, 2);
  EXPECT_EQ(change_keys({"add", "../x", "--role", "client"}).exit_code, 2);
  EXPECT_THAT(change_keys({"revoke", "nobody"}).err, HasSubstr("client, worker, reader"));
  EXPECT_EQ(change_keys({"list", "--format", "csv"}).out, before);
  const Outcome again = run_oblique(folder_, {"keygen", keys_});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("oblique keys add NAME --role ROLE --dir "));
}

TEST_F(KeysTest, TheFileOfARevokedKeyIsKeptAndNamedWhenItsNameIsAddedAgain) {
  ASSERT_EQ(change_keys({"add", "anna", "--role", "client"}).exit_code, 0);
  EXPECT_THAT(change_keys({"revoke", "anna"}).err,
              HasSubstr("The file " + key("anna") + " still exists; it is useless"));
  const Outcome again = change_keys({"add", "anna", "--role", "client"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, AllOf(HasSubstr("the revoked key of anna: remove the file"),
                               HasSubstr("--public='")));
  std::filesystem::remove(key("anna"));
  EXPECT_EQ(change_keys({"add", "anna", "--role", "client"}).exit_code, 0);
}

TEST_F(KeysTest, TheSubfolderKeysIsUsedIfTheCurrentFolderHasNoKeys) {
  EXPECT_THAT(run_oblique(folder_, {"keys", "list"}).out, HasSubstr("reader"));
  EXPECT_EQ(run_oblique(folder_, {"keys", "add", "anna", "--role", "client"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(key("anna")));
  EXPECT_EQ(run_oblique(folder_, {"keys", "revoke", "anna"}).exit_code, 0);
  const TemporaryFolder empty;
  for (const auto& arguments : {std::vector<std::string>{"keys", "list"},
                                {"keys", "add", "anna", "--role", "client"},
                                {"keys", "revoke", "anna"}}) {
    const Outcome outcome = run_oblique(empty, arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("--dir DIR"));
  }
}

TEST_F(KeysTest, SubmittingAgainReportsTheNewPriority) {
  const auto worker = worker_with(key("worker"));
  EXPECT_THAT(run_client(kFewPoints, key("client")).out, Not(HasSubstr("priority")));
  auto again = kFewPoints;
  again.insert(again.end(), {"--priority", "5", "--limit", "2"});
  const Outcome outcome = run_client(again, key("client"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("its priority is now 5"));
  EXPECT_THAT(outcome.err, HasSubstr("More: oblique query few --server " + server_->client_url() +
                                     " --keys " + key("client")));
}

TEST(OpenPortsTest, BeyondLoopbackAServerNeedsKeysOrInsecure) {
  const TemporaryFolder folder;
  const std::vector<std::string> beyond{"--listen", "0.0.0.0",       "--worker-port",
                                        "0",        "--client-port", "0"};
  const Outcome refused = Process(folder, server_program(), beyond).outcome();
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("oblique keygen"), HasSubstr("--insecure")));

  Server open(folder, folder.file("open.db"), {{"OBLIQUE_SERVER_INSECURE", "true"}});
  const Outcome status =
      run_oblique(folder, {"status", "--server", open.client_url(), "--format", "json"});
  EXPECT_THAT(status.err, HasSubstr("--insecure"));
  EXPECT_THAT(open.process().err(), HasSubstr("INSECURE"));
}

TEST(OpenPortsTest, ServerWorkerAndClientConnectByIpv6) {
  const TemporaryFolder folder;
  std::unique_ptr<Server> server;
  try {
    server = std::make_unique<Server>(folder, folder.file("six.db"),
                                      Environment{{"OBLIQUE_SERVER_LISTEN", "::1"}});
  } catch (const std::runtime_error& error) {
    GTEST_SKIP() << "this machine has no IPv6 on its loopback device: " << error.what();
  }
  EXPECT_THAT(server->client_url(), HasSubstr("tcp://[::1]:"));
  const Worker worker(folder, server->worker_url(), {"--threads", "1"});
  auto submit = kFewPoints;
  submit.insert(submit.end(), {"--watch", "--server", server->client_url()});
  const Outcome outcome = run_oblique(folder, submit);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace
}  // namespace oblique::test
