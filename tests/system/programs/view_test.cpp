// `oblique view` serves the page of a database, and solves traces with its own worker.
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/web/raw_http.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

using server::body_of;
using server::RawHttp;
using server::status_of_answer;
using testing::HasSubstr;

/// Waits until `oblique view` prints its address, and returns the address.
std::string printed_url(const Process& view) {
  wait_until("the address is printed", [&] { return view.out().ends_with("\n"); });
  return view.out().substr(0, view.out().size() - 1);
}

/// Opens an address and stores the cookie, as a browser does.
class Browser {
 public:
  explicit Browser(const std::string& address)
      : url_(address.substr(0, address.find("/?"))), host_(url_.substr(url_.find("//") + 2)) {
    const std::string answer = request(address.substr(url_.size()));
    const std::string name = "Set-Cookie: ";
    const std::size_t at = answer.find(name) + name.size();
    cookie_ = answer.substr(at, answer.find(';', at) - at);
  }
  std::string request(const std::string& path) const {
    return RawHttp(url_).exchange("GET " + path + " HTTP/1.1\r\nHost: " + host_ +
                                  "\r\nCookie: " + cookie_ + "\r\n\r\n");
  }

 private:
  std::string url_;
  std::string host_;
  std::string cookie_;
};

TEST(View, ShowsADatabaseAndItsPointsUntilItIsStopped) {
  const TemporaryFolder folder;
  const Outcome made =
      run_oblique(folder, {"run", "--preset", "paper", "--H", "0.5", "--mu", "0.1:1:4", "--e", "1",
                           "--name", "small", "--db", "small.db"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  Process view(folder, client_program(), {"view", "small.db"});
  const Browser browser(printed_url(view));
  EXPECT_THAT(browser.request("/"), HasSubstr("Content-Type: text/html"));
  EXPECT_THAT(browser.request("/api/studies"), HasSubstr("\"name\":\"small\""));
  std::string trace;
  wait_until("a worker has solved the point again", [&] {
    trace = browser.request("/api/studies/1/points/2/trace?shape=1&fall=1");
    return status_of_answer(trace) == 200;
  });
  EXPECT_THAT(body_of(trace), HasSubstr("\"nodes\":13"));
  EXPECT_THAT(body_of(trace), HasSubstr("\"fall_rows\":121"));
  view.send(SIGINT);
  EXPECT_EQ(view.wait(), 0);
  wait_until("server and worker have ended", [&] { return processes_of(folder).empty(); });
}

TEST(View, AMissingFileIsNotCreated) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"view", "nothing.db"}, {"view", "--db", "nothing.db"}}) {
    const Outcome outcome = run_oblique(folder, words);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("there is no file nothing.db"));
  }
}

TEST(View, APortInUseIsReportedWithTheFlagOfTheCommand) {
  const TemporaryFolder folder;
  for (const std::string name : {"first", "second"}) {
    const Outcome made = run_oblique(folder, {"run", "--preset", "paper", "--H", "0.5", "--mu",
                                              "0.4", "--e", "1", "--db", name + ".db"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Process view(folder, client_program(), {"view", "first.db"});
  const std::string url = printed_url(view);
  const std::size_t port = url.rfind(':') + 1;
  const Outcome second = run_oblique(
      folder, {"view", "second.db", "--port", url.substr(port, url.find('/', port) - port)});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_THAT(second.err, HasSubstr("is in use: name another with --port"));
  EXPECT_THAT(second.err, testing::Not(HasSubstr("--http")));
}

TEST(View, ForAReadOnlyFileTheMessageAdvisesACopy) {
  if (::geteuid() == 0) {
    GTEST_SKIP() << "root may write to every file";
  }
  const TemporaryFolder folder;
  const std::string file = folder.file("given.db");
  { const std::ofstream empty(file); }
  ASSERT_EQ(::chmod(file.c_str(), 0444), 0);
  const Outcome outcome = run_oblique(folder, {"view", "given.db"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("oblique backup copy.db --db given.db"));
}

}  // namespace
}  // namespace oblique::test
