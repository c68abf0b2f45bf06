#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"
#include "server/web/page/live_text.h"
#include "server/web/page/page_key.h"
#include "server/web/page/talks.h"

namespace oblique::server {

struct PageSettings {
  /// By which a browser is let in; empty: one is drawn.
  std::string token;
  /// Who comes without it may look, and change nothing.
  bool shows_without_token = false;
  /// The server is of one who shows a file, and ends with that: commands read the file.
  bool is_of_file = false;
  std::string database;  ///< file
  std::string version;
};

/// The page: its files, and what it asks this server for. README.md has every path. Of the HTTP
/// server's thread.
class Page {
 public:
  /// What the page asks. All of them must outlive it.
  struct Neighbours {
    ServiceClient& service;
    LiveText& overview;
  };

  Page(const PageSettings& settings, const Neighbours& neighbours);

  const PageKey& key() const { return key_; }

  /// Whether that path is the page's. The others have no token.
  static bool has(const std::string& path);
  static bool takes_changes(const std::string& path);
  /// Why a change is refused before its body is read.
  std::optional<HttpAnswer> objection_to_change(const HttpQuestion& question) const;
  /// Nothing: it is asked for again.
  std::optional<HttpAnswer> answer(const HttpQuestion& question);
  void gone(std::uint64_t number);

 private:
  /// A path below /api/studies/, taken apart.
  struct Place {
    std::uint64_t study = 0;
    std::string part;  ///< what follows the number
    std::optional<std::uint64_t> point;
  };
  static std::optional<Place> place_of(const std::string& path);

  bool is_trusted(const HttpQuestion& question) const;
  std::optional<HttpAnswer> enter(const HttpQuestion& question) const;
  HttpAnswer session(const HttpQuestion& question) const;
  std::optional<HttpAnswer> begin(const HttpQuestion& question);
  std::optional<HttpAnswer> begin_study(const HttpQuestion& question, const Place& place);
  std::optional<HttpAnswer> begin_change(const HttpQuestion& question);
  std::optional<HttpAnswer> begin(const HttpQuestion& question, Talk talk);
  std::optional<HttpAnswer> begin(const HttpQuestion& question, PendingAnswer pending);
  /// What a request waits for.
  using UnderWay = std::variant<Talk, PendingAnswer>;
  std::optional<HttpAnswer> go_on(const HttpQuestion& question, const UnderWay& under_way);
  std::optional<HttpAnswer> hear(std::uint64_t number, const Talk& talk);

  bool shows_without_token_;
  std::string file_;  // empty: commands ask the server
  std::string version_;
  PageKey key_;
  Neighbours at_;
  std::map<std::uint64_t, UnderWay> under_way_;  // by number of the request
};

}  // namespace oblique::server
