#include "server/web/http_options.h"

#include <stdexcept>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "proto/text.h"
#include "server/web/http/request_rules.h"
#include "server/web/page/page_token.h"

namespace oblique::server {

void HttpOptions::add_to(CLI::App& app) {
  address_option_ =
      app.add_option("--http", address_,
                     "Address and port of the page, metrics and health over HTTP; port 0: "
                     "the system picks one; off: none")
          ->type_name("ADDRESS:PORT");
  app.add_option(
         "--http-name", names_,
         "Host name of this server besides numeric addresses and localhost; may be repeated")
      ->type_name("HOST");
  app.add_flag("--http-read-without-token", shows_without_token_,
               "Show the page to everybody who reaches the address; changes still need the token");
  app.add_option(
         "--http-token-file", token_file_,
         "File with the token of the page, 32 to 128 letters and digits, made if it does not "
         "exist; without it a token is drawn at each start")
      ->type_name("FILE");
}

std::optional<WebSettings> HttpOptions::settings() const {
  WebSettings settings;
  for (const std::string& name : names_) {
    const std::string lower = CLI::detail::to_lower(name);
    if (lower.empty() || host_without_port(lower) != lower) {
      throw std::runtime_error(
          fmt::format("--http-name {} is no host name, as oblique.example.org without a port",
                      protocol::visible(name)));
    }
    settings.names.insert(lower);
  }
  const auto address = parse_http_address(address_);
  if (!address) {
    return std::nullopt;
  }
  settings.address = *address;
  settings.page.shows_without_token = shows_without_token_;
  if (!token_file_.empty()) {
    settings.page.token = PageToken::from_file(token_file_);
  }
  // A second server on a machine goes on without the default port, which the first one has.
  settings.may_be_missing = address_option_->count() == 0;
  return settings;
}

}  // namespace oblique::server
