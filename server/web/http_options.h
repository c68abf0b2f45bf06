#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/web/web.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace oblique::server {

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

}  // namespace oblique::server
