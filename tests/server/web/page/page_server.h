#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/server/event_loop/running_server.h"
#include "tests/server/web/raw_http.h"
#include "tests/support/points.h"
#include "tests/support/recipes.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {

inline constexpr const char* kTestToken = "0123456789abcdef0123456789abcdef";

inline WebSettings page_settings(bool shows_without_token = false) {
  WebSettings settings;
  settings.address = {"127.0.0.1", "*"};
  settings.limits.idle = test::kHangLimit;
  settings.page.token = PageToken(kTestToken);
  settings.page.shows_without_token = shows_without_token;
  return settings;
}

/// An answer to the page that consists of a JSON header and binary numbers.
struct Numbers {
  nlohmann::json head;
  std::string bytes;

  template <typename Number>
  std::vector<Number> read(std::size_t from_byte, std::size_t count) const {
    std::vector<Number> numbers(count);
    if (from_byte + count * sizeof(Number) > bytes.size()) {
      throw std::runtime_error("the answer contains fewer numbers than expected");
    }
    std::memcpy(numbers.data(), bytes.data() + from_byte, count * sizeof(Number));
    return numbers;
  }
};

/// Runs a whole server, and simulates a browser that has access to the page.
class PageServer {
 public:
  explicit PageServer(const WebSettings& web = page_settings(), const std::string& database = {})
      : database_(database.empty() ? folder_.file("a.db") : database),
        server_(database_, {}, {}, {}, {}, web) {
    const std::string answer = request("GET", std::string("/?token=") + kTestToken, "");
    const std::string name = "Set-Cookie: ";
    const std::size_t at = answer.find(name);
    if (at != std::string::npos) {
      cookie_ = answer.substr(at + name.size(), answer.find(';', at) - at - name.size());
    }
  }

  const RunningServer& server() const { return server_; }
  std::string database() const { return database_; }
  std::string url() const { return server_.http_url(); }
  std::string host() const { return url().substr(std::string("http://").size()); }
  std::string cookie_header() const { return "Cookie: " + cookie_ + "\r\n"; }

  std::string request(const std::string& method, const std::string& path,
                      const std::string& headers, const std::string& body = "") const {
    return RawHttp(url()).exchange(method + " " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n" +
                                   headers + "\r\n" + body);
  }
  /// Sends a request with the cookie that the page received.
  std::string get(const std::string& path) const { return request("GET", path, cookie_header()); }
  int status(const std::string& path) const { return status_of_answer(get(path)); }
  /// Sends a request. The caller must read the answer.
  std::unique_ptr<RawHttp> begin(const std::string& path) const {
    auto browser = std::make_unique<RawHttp>(url());
    browser->send("GET " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n" + cookie_header() +
                  "\r\n");
    return browser;
  }
  nlohmann::json json(const std::string& path) const {
    return nlohmann::json::parse(body_of(get(path)));
  }
  std::string post(const std::string& path, const std::string& body = "{}") const {
    return request("POST", path,
                   cookie_header() + "Origin: " + url() +
                       "\r\nSec-Fetch-Site: same-origin\r\nContent-Length: " +
                       std::to_string(body.size()) + "\r\n",
                   body);
  }
  Numbers numbers(const std::string& path) const {
    const std::string body = body_of(get(path));
    std::uint32_t length = 0;
    if (body.size() < sizeof length) {
      throw std::runtime_error("the answer has no JSON header: " + body);
    }
    std::memcpy(&length, body.data(), sizeof length);
    return {nlohmann::json::parse(body.substr(sizeof length, length)),
            body.substr(sizeof length + length)};
  }

 private:
  test::TemporaryFolder folder_;
  std::string database_;
  RunningServer server_;
  std::string cookie_;
};

/// Returns the peak force in the result of `solved_point`.
inline float force_of(std::uint64_t point) {
  return static_cast<float>(std::round((1.0 / 3.0 + static_cast<double>(point)) * 1e4 * 1e5) / 1e5);
}

/// Provides a server with its page, and studies that a simulated worker solves.
class PageStudyTest : public testing::Test {
 protected:
  void submit(const std::string& name, const protocol::Recipe& recipe) {
    ClientRequest request;
    request.mutable_submit()->set_name(name);
    *request.mutable_submit()->mutable_recipe() = recipe;
    ASSERT_TRUE(client_.reply_to(request).has_submit());
  }
  void solve(std::uint64_t points, const std::set<std::uint64_t>& failing = {}) {
    SimulatedWorker worker(page_.server().worker_endpoint());
    worker.fail(failing);
    worker.hello();
    worker.work(points);
  }
  /// Returns a grid of three values of H, four of mu and two of e.
  static protocol::Recipe grid_recipe() {
    return protocol::recipe_of(
        {{protocol::listed("H", {1.0, 0.9, 0.8}), protocol::range("mu", 0.0, 0.6, 4),
          protocol::listed("e", {1.0, 0.5})}});
  }
  static protocol::Recipe filtered_grid(const std::string& where) {
    protocol::Recipe recipe = grid_recipe();
    recipe.mutable_blocks(0)->set_where(where);
    return recipe;
  }
  Numbers slice_of(const std::string& query) const {
    return page_.numbers("/api/studies/1/slice?" + query);
  }
  Numbers bins_of(const std::string& query) const {
    return page_.numbers("/api/studies/1/bins?" + query);
  }
  void submit_grid() { submit("grid", grid_recipe()); }
  void solve_grid() {
    submit_grid();
    solve(24);
  }

  PageServer page_;
  SimulatedClient client_{page_.server().client_endpoint()};
};

}  // namespace oblique::server
