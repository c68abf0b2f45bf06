// Pictures that the server has drawn by another program: of what it starts, with which arguments,
// and what becomes of its end.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/pictures/child.h"
#include "tests/server/web/page/page_server.h"
#include "tests/support/points.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

std::string text_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A server that has its pictures drawn by a script of the test, and a study of 3 heights, 4
/// frictions and 2 restitutions, whose results are there.
class PagePicturesTest : public testing::Test {
 protected:
  /// Empty: that beside the program that runs.
  void start(const std::string& program, ChildLimits limits = {}) {
    WebSettings settings = page_settings();
    settings.page.pictures.program = program;
    settings.page.pictures.limits = limits;
    page_ = std::make_unique<PageServer>(settings);
    PretendedClient client(page_->server().client_endpoint());
    ClientRequest request;
    request.mutable_submit()->set_name("grid");
    *request.mutable_submit()->mutable_recipe() = protocol::recipe_of(
        {{protocol::listed("H", {1.0, 0.9, 0.8}), protocol::range("mu", 0.0, 0.6, 4),
          protocol::listed("e", {1.0, 0.5})}});
    ASSERT_TRUE(client.ask(request).has_submit());
    PretendedWorker worker(page_->server().worker_endpoint());
    worker.hello();
    worker.work(24);
  }
  std::string script(const std::string& lines) const {
    std::string path = folder_.file("oblique");
    std::ofstream(path) << "#!/bin/sh\n" << lines << '\n';
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
  }
  /// One that says its arguments, a line each.
  std::string speaking() const { return script(R"(for each in "$@"; do echo "[$each]"; done)"); }
  std::string get(const std::string& query) const {
    return page_->get("/api/studies/1/picture" + query);
  }
  std::string arguments_of(const std::string& query) const { return body_of(get(query)); }
  std::string db() const { return "[--db=" + page_->database() + "]\n"; }

  test::TemporaryFolder folder_;
  std::unique_ptr<PageServer> page_;
};

TEST_F(PagePicturesTest, EveryFieldIsOneArgument) {
  start(speaking());
  EXPECT_EQ(arguments_of("?kind=map&z=fn_peak_N&x=mu&y=H&at=e:0.6&where=mu%20%3C%200.5&zlog=1&"
                         "from=1&to=2e5&width=480&height=360&format=png"),
            "[plot]\n[--quiet]\n" + db() +
                "[--map=fn_peak_N]\n[--x=mu]\n[--y=H]\n[--at=e=0.5]\n[--where=mu < 0.5]\n"
                "[--log-colour]\n[--range=1:200000]\n[--size=480x360]\n"
                "[--format=png]\n[--]\n[grid]\n");
  EXPECT_EQ(arguments_of("?kind=scatter&x=mu&y=slide_m&z=e"),
            "[plot]\n[--quiet]\n" + db() +
                "[--scatter=mu,slide_m]\n[--colour=e]\n[--format=svg]\n[--]\n[grid]\n");
  EXPECT_THAT(arguments_of("?kind=lines&z=duration_s&x=mu&by=H&at=e@1&xlog=1"),
              HasSubstr("[--lines=duration_s]\n[--x=mu]\n[--by=H]\n[--at=e=0.5]\n[--log-x]\n"));
  EXPECT_THAT(arguments_of("?kind=histogram&x=abs(fn_peak_N)"),
              HasSubstr("[--histogram=abs(fn_peak_N)]\n"));
  EXPECT_EQ(
      body_of(page_->get("/api/studies/1/points/7/picture?panel=loop")),
      "[plot]\n[--quiet]\n" + db() + "[--point=7]\n[--panel=loop]\n[--format=svg]\n[--]\n[grid]\n");
}

TEST_F(PagePicturesTest, NothingFromOutsideBecomesAnotherFlag) {
  start(speaking());
  const std::string plain = arguments_of("?kind=map&z=fn_peak_N");
  EXPECT_EQ(arguments_of("?kind=map&z=fn_peak_N&db=/etc/passwd&--db=/etc/passwd&out=/tmp/x&"
                         "server=tcp://evil&program=/bin/sh"),
            plain);
  for (const std::string query : {"?kind=map&z=--db=/etc/passwd",
                                  "?kind=map&z=fn_peak_N%0A--db=/etc/passwd",
                                  "?kind=map&z=fn_peak_N%1b[31m",
                                  "?kind=map&z=a;b",
                                  "?kind=map&z=fn_peak_N&x=(mu",
                                  "?kind=map%20--db=x&z=mu",
                                  "?kind=--db=x",
                                  "?kind=scatter",
                                  "?kind=scatter&x=mu",
                                  "?kind=histogram",
                                  "?kind=map",
                                  "?format=svg%20--out=/tmp/x",
                                  "?format=--out=/tmp/x",
                                  "?format=pdf",
                                  "?width=1x1&height=--out=x",
                                  "?width=480",
                                  "?width=99999&height=1",
                                  "?from=1:2&to=3",
                                  "?from=1",
                                  "?from=nan&to=1",
                                  "?xlog=yes",
                                  "?at=e",
                                  "?at=--db:1",
                                  "?at=e:1%20--out=x",
                                  "?at=e@2",
                                  "?at=k:1",
                                  "?where=1)%20OR%20(1",
                                  "?where=1%20--",
                                  "?where=mu%20%3C%0A1%01",
                                  "?where=%ff"}) {
    const std::string answer = get(query);
    EXPECT_EQ(status_of_answer(answer), 400) << query << body_of(answer);
    EXPECT_TRUE(json::parse(body_of(answer)).contains("error")) << query;
  }
  for (const std::string query : {"?panel=--db=x", "?format=exe", "?width=1"}) {
    EXPECT_EQ(status_of_answer(page_->get("/api/studies/1/points/7/picture" + query)), 400);
  }
  // What looks like a flag is a value all the same.
  EXPECT_THAT(arguments_of("?kind=map&z=-fn_peak_N&x=-mu"),
              HasSubstr("[--map=-fn_peak_N]\n[--x=-mu]"));
  EXPECT_THAT(arguments_of("?kind=map&z=%24(id)"), Not(HasSubstr("uid=")));
}

TEST_F(PagePicturesTest, LongFieldsAreRefusedAndHarmNobody) {
  start(speaking());
  EXPECT_EQ(status_of_answer(get("?kind=map&z=" + std::string(5000, 'a'))), 400);
  const int status = status_of_answer(get("?kind=map&z=" + std::string(1'000'000, 'a')));
  EXPECT_TRUE(status == 0 || (status >= 400 && status < 500)) << status;
  EXPECT_EQ(status_of_answer(get("?kind=map&z=mu")), 200);
}

TEST_F(PagePicturesTest, WhatIsNotThereIsNotDrawn) {
  start(speaking());
  EXPECT_EQ(status_of_answer(page_->get("/api/studies/2/picture")), 404);
  EXPECT_EQ(status_of_answer(page_->get("/api/studies/1/points/24/picture")), 404);
  EXPECT_EQ(status_of_answer(page_->get("/api/studies/1/points/7/picture/")), 404);
  EXPECT_EQ(status_of_answer(page_->get("/api/studies/1/picture/7")), 404);
}

TEST_F(PagePicturesTest, APictureIsAFileToKeep) {
  start(script("printf '\\000\\377<svg/>'"));
  const std::string answer = get("?kind=map&z=mode");
  EXPECT_EQ(body_of(answer), std::string("\0\377<svg/>", 8));
  EXPECT_THAT(answer, HasSubstr("Content-Type: image/svg+xml\r\n"));
  EXPECT_THAT(answer, HasSubstr("Content-Disposition: attachment; filename=\"grid.svg\"\r\n"));
  EXPECT_THAT(page_->get("/api/studies/1/points/7/picture?format=csv"),
              HasSubstr("Content-Disposition: attachment; filename=\"grid-point-7.csv\"\r\n"));
}

TEST_F(PagePicturesTest, ItsSentenceIsTheAnswer) {
  start(script(R"(echo half a picture
printf 'oblique plot: --map muu: there is no such column\nTry `oblique plot --help`.\n' >&2
case "$4" in --map=*) exit 2;; *) exit 1;; esac)"));
  const std::string wrong = get("?kind=map&z=muu");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_EQ(json::parse(body_of(wrong))["error"], "--map muu: there is no such column");
  EXPECT_EQ(status_of_answer(get("")), 422);
}

TEST_F(PagePicturesTest, AProgramThatIsNotThereIsSaid) {
  start("/nowhere/oblique");
  const std::string answer = get("?kind=map&z=mode");
  EXPECT_EQ(status_of_answer(answer), 503);
  EXPECT_THAT(answer, HasSubstr("/nowhere/oblique: No such file or directory"));
  EXPECT_THAT(answer, HasSubstr("--http-plot-program"));
}

TEST_F(PagePicturesTest, OneThatTakesTooMuchIsEnded) {
  ChildLimits limits;
  limits.output_bytes = 100'000;
  start(script(R"(case "$4" in --map=*) exec yes;; *) kill -9 $$;; esac)"), limits);
  EXPECT_EQ(status_of_answer(get("?kind=map&z=mode")), 503);
  EXPECT_THAT(get("?kind=map&z=mode"), HasSubstr("too large"));
  EXPECT_THAT(get(""), HasSubstr("was killed"));
}

TEST_F(PagePicturesTest, OnesSurroundingsAreNotHanded) {
  ::setenv("OBLIQUE_SERVER", "tcp://127.0.0.1:1", 1);
  start(script("echo \"[$OBLIQUE_SERVER]\"; ls /proc/self/fd | wc -l; cat; nice; ulimit -c"));
  ::unsetenv("OBLIQUE_SERVER");
  // Its three, and that of the folder that `ls` looks into.
  EXPECT_EQ(arguments_of(""), "[]\n4\n5\n0\n");
}

TEST_F(PagePicturesTest, ItEndsWithItsBrowserAndWithTheServer) {
  const std::string file = folder_.file("pid");
  start(script("sleep 600 & echo $! > " + file + ".new; mv " + file + ".new " + file + "; wait"));
  for (const bool ends_server : {false, true}) {
    auto browser = std::make_unique<RawHttp>(page_->url());
    browser->send("GET /api/studies/1/picture HTTP/1.1\r\nHost: " + page_->host() + "\r\n" +
                  page_->cookie_header() + "\r\n");
    const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
    while (!std::filesystem::exists(file)) {
      pause();
    }
    const auto sleeper = static_cast<pid_t>(std::stoi(text_of_file(file)));
    EXPECT_EQ(::kill(sleeper, 0), 0);
    std::filesystem::remove(file);
    if (ends_server) {
      page_.reset();
    } else {
      browser.reset();
    }
    // Who adopted it may not wait for it at once: a dead one is as good as none.
    const auto is_alive = [sleeper] {
      const std::string status = text_of_file("/proc/" + std::to_string(sleeper) + "/stat");
      return !status.empty() && status.find(") Z") == std::string::npos;
    };
    while (is_alive()) {
      pause();
    }
  }
}

/// What a command line gives on standard output.
std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), &::pclose);
  std::string all;
  std::array<char, 4096> some{};
  while (const std::size_t got = std::fread(some.data(), 1, some.size(), pipe.get())) {
    all.append(some.data(), got);
  }
  return all;
}

TEST_F(PagePicturesTest, APictureHasTheBytesOfObliquePlot) {
  const auto own = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "oblique";
  if (!std::filesystem::exists(own)) {
    GTEST_SKIP() << "the program oblique was not built";
  }
  ChildLimits limits;
  limits.memory_bytes = 0;  // sanitizers reserve much
  start("", limits);
  const std::string plot =
      "'" + own.string() + "' plot grid --format svg --db " + page_->database();
  const std::string map = output_of(plot + " --map fn_peak_N --x mu --y H --at e=0.5 2>/dev/null");
  EXPECT_THAT(map, HasSubstr("<svg"));
  EXPECT_EQ(body_of(get("?kind=map&z=fn_peak_N&x=mu&y=H&at=e@1")), map);
  EXPECT_EQ(body_of(page_->get("/api/studies/1/points/3/picture?panel=loop")),
            output_of(plot + " --point 3 --panel loop 2>/dev/null"));
  const std::string wrong = get("?kind=map&z=muu");
  EXPECT_EQ(status_of_answer(wrong), 400);
  EXPECT_THAT(wrong, HasSubstr("muu"));
}

TEST(RunChild, HearsTheBeginningOfWhatIsSaidAndLetsItGoOn) {
  const ChildEnd end =
      run_child("/bin/sh", {"sh", "-c", "head -c 1000000 /dev/zero >&2 && echo drawn"}, {},
                [] { return false; });
  EXPECT_EQ(end.kind, ChildEnd::Kind::kEnded);
  EXPECT_EQ(end.output, "drawn\n");
  EXPECT_EQ(end.said.size(), 4096U);
}

}  // namespace
}  // namespace oblique::server
