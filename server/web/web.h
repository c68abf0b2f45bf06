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
  /// If the address is taken the server goes on without HTTP.
  bool may_be_missing = false;
  std::set<std::string> names;  ///< Host names besides addresses and localhost; in lower case
  HttpLimits limits;
  std::string database;  ///< file
  PageSettings page;
  std::string solver_version;
};

/// The flags of what is shown over HTTP, and to whom.
class HttpOptions {
 public:
  /// This must outlive the parsing.
  void add_to(CLI::App& app);
  /// Of the parsed flags; nothing: no HTTP. Throws std::runtime_error for an invalid address or
  /// name.
  std::optional<WebSettings> settings() const;

 private:
  std::string address_ = "127.0.0.1:7602";
  std::vector<std::string> names_;
  bool shows_without_token_ = false;
  std::string token_file_;
  const CLI::Option* address_option_ = nullptr;
};

/// The server over HTTP: metrics and health for machines, and the page for people. The event loop
/// publishes a snapshot twice a second and is not asked for anything else, except by requests to
/// the service.
class Web {
 public:
  /// Answers from now on. Throws std::runtime_error, naming the address, if it cannot.
  explicit Web(WebSettings settings);

  /// As http://127.0.0.1:7602.
  std::string url() const { return http_.url(); }
  /// The same with the token that lets a browser in.
  std::string page_url() const { return url() + "/?token=" + page_.token().text(); }

  // ---- Called by the event loop.
  /// Whether the page is that client of the service.
  static bool is_client(const std::string& identity) {
    return identity == ServiceClient::kIdentity;
  }
  /// Readable when the page has requests.
  int descriptor() const { return service_.descriptor(); }
  std::vector<std::string> take_requests() { return service_.take(); }
  /// Takes the frame of a reply to the page; true.
  bool put_reply(const std::string& frame);
  /// To be called several times a second.
  void tick(const SnapshotSources& sources, std::int64_t now_ms);

 private:
  HttpOutcome answer(const HttpRequest& request);

  const WebSettings settings_;
  const std::int64_t started_ms_;
  std::int64_t published_ms_ = 0;  // used by the event loop only
  SnapshotCache snapshots_;
  ServiceClient service_;
  Page page_;
  HttpServer http_;  // last: its thread uses the other members
};

/// Whether the event loop runs: 200 if the latest snapshot, or the start, is recent enough.
HttpAnswer health(std::int64_t made_ms, std::int64_t now_ms);

/// Whether the server takes work: 200 unless it stops, the database takes no results, or its disk
/// is almost full.
HttpAnswer readiness(const Snapshot& snapshot, double free_bytes);

}  // namespace oblique::server
