#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"
#include "server/web/status/snapshot.h"

namespace oblique::server {

/// A file of the page, from `client/web`.
struct PageFile {
  std::string_view path;  ///< such as /overview.js
  std::string_view content_type;
  std::string_view tag;  ///< ETag, with its quotes
  std::span<const unsigned char> plain;
  std::span<const unsigned char> gzipped;
};

/// Returns all files of the page. The build generates them.
std::span<const PageFile> page_files();

/// Controls what browsers may do: the token, which people get with the address of the page, is
/// exchanged for a cookie that no script and no other site can use. Both give the rights of a
/// client.
class PageToken {
 public:
  /// Creates a random token of 256 bits.
  PageToken();
  /// Uses a given token. The cookie is computed from the token, so it stays valid after a restart.
  explicit PageToken(std::string token);
  /// Reads the token from a file that only its owner may read. Creates a missing file with a random
  /// token. Throws std::runtime_error, which names the file and the fault.
  static PageToken from_file(const std::string& path);

  const std::string& text() const { return text_; }
  bool is(std::string_view text) const;
  /// Returns the value of a Set-Cookie header. The name of the cookie contains the port in `host`,
  /// the Host header, because browsers send cookies to all ports.
  std::string cookie_for(const std::string& host) const;
  /// Returns whether one of these Cookie headers contains the cookie.
  bool is_in(const std::vector<std::string>& cookies, const std::string& host) const;

 private:
  std::string text_;
  std::string cookie_;
};

struct PageSettings {
  PageToken token;
  bool shows_without_token = false;  ///< if true, reading needs no token
  /// True if the server belongs to `oblique view` and ends with it. The page then shows commands
  /// that read the file.
  bool is_of_file = false;
};

/// Sends the overview to all browser tabs as server-sent events named `overview`. Its text is made
/// once for all tabs, and only if there are tabs. A slow tab gets only the latest text. Used by the
/// HTTP thread.
class EventFeed {
 public:
  explicit EventFeed(const SnapshotCache& snapshots) : snapshots_(snapshots) {}

  /// Returns a stream that begins with the current overview, unless `last_event_id` is the
  /// overview's ID. A comment every 15 s keeps the connection open.
  HttpStream subscribe(const std::string& last_event_id);

 private:
  void refresh();

  const SnapshotCache& snapshots_;
  std::shared_ptr<const Snapshot> seen_;
  std::string overview_;
  std::string id_;  ///< ID of the overview; empty if there is none yet
};

/// Answers requests for the page's files and API (README.md lists the paths), on the HTTP thread.
class Page {
 public:
  /// `service` and `snapshots` must outlive the page.
  Page(PageSettings settings, std::string database, ServiceClient& service,
       const SnapshotCache& snapshots);

  const PageToken& token() const { return settings_.token; }

  /// Returns the answer that refuses a POST before its body is read; nothing if it is accepted.
  std::optional<HttpAnswer> refuse_change(const HttpRequest& request) const;
  /// Answers a request; nothing for an unknown path. Throws std::invalid_argument for a wrong
  /// request.
  std::optional<HttpOutcome> answer(const HttpRequest& request);

 private:
  bool is_trusted(const HttpRequest& request) const;
  HttpAnswer enter(const HttpRequest& request) const;
  HttpAnswer session(const HttpRequest& request) const;
  std::optional<HttpOutcome> read(const HttpRequest& request);
  std::optional<HttpOutcome> change(const HttpRequest& request);

  PageSettings settings_;
  std::string database_;
  ServiceClient& service_;
  EventFeed events_;
};

}  // namespace oblique::server
