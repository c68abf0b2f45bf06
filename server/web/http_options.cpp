#include "server/web/http_options.h"

#include <stdexcept>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "proto/text.h"
#include "server/web/http/request_rules.h"
#include "server/web/page/token_file.h"

namespace oblique::server {

void HttpOptions::add_to(CLI::App& app) {
  address_option_ =
      app.add_option("--http", address_,
                     "Address and port of the page, metrics and health over HTTP; port 0: "
                     "the system picks one; off: none")
          ->type_name("ADDRESS:PORT");
  app.add_option("--http-name", names_,
                 "Host name by which HTTP is asked, beside numeric addresses and localhost; may be "
                 "given again")
      ->type_name("HOST");
  app.add_flag("--http-read-without-token", shows_to_all_,
               "Show the page to whoever reaches the address; changing something takes the token");
  app.add_option(
         "--http-token-file", token_file_,
         "File with the token of the page, 32 to 128 letters and digits, made when it is not "
         "there; without it a token is drawn at each start")
      ->type_name("FILE");
}

std::optional<WebSettings> HttpOptions::settings() const {
  WebSettings settings;
  for (const std::string& name : names_) {
    const std::string lower = CLI::detail::to_lower(name);
    if (host_without_port(lower) != lower) {
      throw std::runtime_error(
          fmt::format("--http-name {} is no host name, as oblique.example.org without a port",
                      protocol::visible(name)));
    }
    settings.names.insert(lower);
  }
  const auto address = http_address_of(address_);
  if (!address) {
    return std::nullopt;
  }
  settings.address = *address;
  settings.page.shows_without_token = shows_to_all_;
  if (!token_file_.empty()) {
    settings.page.token = token_of_file(token_file_);
  }
  // A second server on a machine need not be told that the first one has the port.
  settings.may_be_missing = address_option_->count() == 0;
  return settings;
}

}  // namespace oblique::server
