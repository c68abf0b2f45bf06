#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/web/http/http_server.h"
#include "server/web/page/page.h"
#include "server/web/snapshot.h"

namespace oblique::server {

struct WebSettings {
  HttpAddress address;
  /// A server that finds the address taken goes on without, rather than end.
  bool may_be_missing = false;
  std::set<std::string> names;  ///< Host names beside addresses and localhost; in lower case
  HttpLimits limits;
  /// A loop that makes no snapshot in this time is held up, and the last one is shown.
  std::chrono::milliseconds patience{2000};
  std::string database;  ///< file
  PageSettings page;
  std::string solver_version;
};

/// The server over HTTP: metrics, health and readiness for machines, and the page for people. The
/// loop is asked for a snapshot only when one is to be shown.
class Web {
 public:
  /// Answers from now on. Throws std::runtime_error, naming the address, when it cannot.
  explicit Web(WebSettings settings);
  ~Web();
  Web(const Web&) = delete;
  Web& operator=(const Web&) = delete;

  /// As http://127.0.0.1:7602.
  std::string url() const;

  /// The same with the token that lets a browser in.
  std::string page_url() const;

  /// Whether the page is that client of the service; of the loop, as what follows.
  static bool is_client(const std::string& identity);
  /// Readable when the page has requests.
  int descriptor() const;
  std::vector<std::string> take_requests();
  /// The frame of a reply to the page; true.
  bool put_reply(const std::string& frame);

  /// From the loop, several times a second; costs nothing while nobody asks.
  void tick(const SnapshotSources& sources, std::int64_t now_ms);

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::server
