#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"
#include "server/web/page/event_feed.h"
#include "server/web/page/page_token.h"

namespace oblique::server {

struct PageSettings {
  PageToken token;
  bool shows_without_token = false;  ///< reading needs no token
  /// The server belongs to a program that shows a file and ends with it: commands read the file.
  bool is_of_file = false;
  std::string database;
  std::string version;
};

/// The page: its files, and what it asks this server for. README.md has every path. Used by the
/// HTTP server's thread.
class Page {
 public:
  /// The references must outlive the page.
  Page(PageSettings settings, ServiceClient& service, EventFeed& events);

  const PageToken& token() const { return settings_.token; }

  /// Why a POST is refused before its body is read.
  std::optional<HttpAnswer> refuse_change(const HttpRequest& request) const;
  /// Nothing: there is nothing at that path. Throws std::invalid_argument for a wrong request.
  std::optional<HttpOutcome> answer(const HttpRequest& request);

 private:
  bool is_trusted(const HttpRequest& request) const;
  HttpAnswer enter(const HttpRequest& request) const;
  HttpAnswer session(const HttpRequest& request) const;
  std::optional<HttpOutcome> read(const HttpRequest& request);
  std::optional<HttpOutcome> change(const HttpRequest& request);

  PageSettings settings_;
  ServiceClient& service_;
  EventFeed& events_;
};

}  // namespace oblique::server
