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

/// The flags that say what is shown over HTTP, and to whom.
class HttpOptions {
 public:
  /// This must outlive the parsing.
  void add_to(CLI::App& app);
  /// To be asked after the parsing; nothing: no HTTP. Throws std::runtime_error for what is no
  /// address and no name.
  std::optional<WebSettings> settings() const;

 private:
  std::string address_ = "127.0.0.1:7602";
  std::vector<std::string> names_;
  bool shows_to_all_ = false;
  std::string token_file_;
  const CLI::Option* address_option_ = nullptr;
};

}  // namespace oblique::server
