#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/web/answers/service_client.h"
#include "server/web/http/http_server.h"
#include "server/web/page/page.h"
#include "server/web/status/snapshot.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace oblique::server {

struct WebSettings {
  HttpAddress address;
  /// If true and the address is in use, the server runs without HTTP.
  bool may_be_missing = false;
  std::set<std::string> names;  ///< further allowed host names, in lower case
  HttpLimits limits;
  std::string database;  ///< path of the database file
  PageSettings page;
  std::string solver_version;
};

/// The command-line flags for HTTP.
class HttpOptions {
 public:
  /// This object must outlive the parsing of the command line.
  void add_to(CLI::App& app);
  /// Returns the settings from the parsed flags; nothing if HTTP is off. Throws std::runtime_error
  /// for an invalid address or name.
  std::optional<WebSettings> settings() const;

 private:
  std::string address_ = "127.0.0.1:7602";
  std::vector<std::string> names_;
  bool shows_without_token_ = false;
  std::string token_file_;
  const CLI::Option* address_option_ = nullptr;
};

/// HTTP interface of the server: metrics and health for machines, and the page for people. The
/// event loop publishes a snapshot twice a second and answers requests to the service; the HTTP
/// thread does the rest.
class Web {
 public:
  /// Starts to answer requests. Throws std::runtime_error, which names the address, if it cannot.
  explicit Web(WebSettings settings);

  /// Returns an address such as http://127.0.0.1:7602.
  std::string url() const { return http_.url(); }
  /// Returns the page's address with its token.
  std::string page_url() const { return url() + "/?token=" + page_.token().text(); }

  // ---- Called by the event loop.
  // Returns whether the client with this identity is the page.
  static bool is_client(const std::string& identity) {
    return identity == ServiceClient::kIdentity;
  }
  /// Returns a descriptor that becomes readable when the page has requests.
  int descriptor() const { return service_.descriptor(); }
  std::vector<std::string> take_requests() { return service_.take(); }
  /// Passes an encoded reply to the page. Always returns true.
  bool put_reply(const std::string& frame);
  /// Must be called several times a second.
  void tick(const SnapshotSources& sources, std::int64_t now_ms);

 private:
  HttpOutcome answer(const HttpRequest& request);

  const WebSettings settings_;
  const std::int64_t started_ms_;
  std::int64_t published_ms_ = 0;  // used only by the event loop
  SnapshotCache snapshots_;
  ServiceClient service_;
  Page page_;
  HttpServer http_;  // declared last, because its thread uses the other members
};

/// Health: 200 if the latest snapshot is recent, which shows that the loop runs. `made_ms` is the
/// time of the snapshot, or of the start if there is no snapshot yet.
HttpAnswer health(std::int64_t made_ms, std::int64_t now_ms);

/// Readiness: 200 unless the server is stopping, the database accepts no results, or its disk is
/// almost full.
HttpAnswer readiness(const Snapshot& snapshot, double free_bytes);

}  // namespace oblique::server
