#include "server/web/http/http_parts.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <poll.h>
#include <strings.h>

namespace oblique::server {
namespace {

/// Nothing for what is no number of bytes.
std::optional<std::uint64_t> bytes_of(const std::string& text) {
  std::uint64_t bytes = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, bytes);
  return error == std::errc() && rest == end ? std::optional(bytes) : std::nullopt;
}

MHD_Result take_header(void* into, MHD_ValueKind /*kind*/, const char* key, const char* value) {
  const auto is = [key](const char* name) { return strcasecmp(key, name) == 0; };
  auto& [head, question] = *static_cast<Asked*>(into);
  const std::string text = value == nullptr ? "" : value;
  if (is(MHD_HTTP_HEADER_HOST)) {
    head.hosts.push_back(text);
    question.host = text;
  } else if (is(MHD_HTTP_HEADER_ORIGIN)) {
    head.origins.push_back(text);
  } else if (is("Sec-Fetch-Site")) {
    head.fetch_sites.push_back(text);
  } else if (is("Sec-Fetch-Mode")) {
    head.fetch_modes.push_back(text);
  } else if (is("Sec-Fetch-Dest")) {
    head.fetch_targets.push_back(text);
  } else if (is(MHD_HTTP_HEADER_TRANSFER_ENCODING)) {
    head.has_body = true;
  } else if (is(MHD_HTTP_HEADER_CONTENT_LENGTH)) {
    head.has_body = head.has_body || text != "0";
    head.body_bytes = bytes_of(text);
  } else if (is(MHD_HTTP_HEADER_COOKIE)) {
    question.cookies.push_back(text);
  } else if (is(MHD_HTTP_HEADER_IF_NONE_MATCH)) {
    question.known_tag = text;
  } else if (is("Last-Event-ID")) {
    question.seen_event = text;
  } else if (is(MHD_HTTP_HEADER_ACCEPT_ENCODING)) {
    question.takes_gzip = text.find("gzip") != std::string::npos;
  }
  return MHD_YES;
}

MHD_Result take_field(void* into, MHD_ValueKind /*kind*/, const char* key, std::size_t key_bytes,
                      const char* value, std::size_t value_bytes) {
  auto& [head, question] = *static_cast<Asked*>(into);
  const std::string name(key, key_bytes);
  const std::string text = value == nullptr ? std::string() : std::string(value, value_bytes);
  head.has_zero_bytes = head.has_zero_bytes || name.find('\0') != std::string::npos ||
                        text.find('\0') != std::string::npos;
  question.fields.try_emplace(name, text);
  return MHD_YES;
}

/// What a page of ours may load, and who may have it: ourselves.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

Asked asked_on(MHD_Connection* connection, const char* method, const char* path) {
  Asked asked;
  asked.head.method = method;
  asked.question.method = method;
  asked.question.path = path;
  MHD_get_connection_values(connection, MHD_HEADER_KIND, take_header, &asked);
  MHD_get_connection_values_n(connection, MHD_GET_ARGUMENT_KIND, take_field, &asked);
  // The frame of the page alone: with a token it would let a browser in.
  asked.head.may_be_linked_to = asked.question.path == "/" && asked.question.fields.empty();
  return asked;
}

MHD_Response* buffered(std::string body) {
  auto owned = std::make_unique<std::string>(std::move(body));
  MHD_Response* const response = MHD_create_response_from_buffer_with_free_callback_cls(
      owned->size(), owned->data(), [](void* text) { delete static_cast<std::string*>(text); },
      owned.get());
  if (response != nullptr) {
    static_cast<void>(owned.release());  // the library's from now on
  }
  return response;
}

void add_headers(MHD_Response* response, const HttpAnswer& answer) {
  const std::array<std::pair<const char*, const char*>, 8> headers{
      {{MHD_HTTP_HEADER_CONTENT_TYPE, answer.content_type.c_str()},
       {MHD_HTTP_HEADER_CONNECTION, "close"},
       {MHD_HTTP_HEADER_X_CONTENT_TYPE_OPTIONS, "nosniff"},
       {"Content-Security-Policy", kContentPolicy},
       {"Cross-Origin-Resource-Policy", "same-origin"},
       {"Cross-Origin-Opener-Policy", "same-origin"},
       {"Cross-Origin-Embedder-Policy", "require-corp"},
       {"Referrer-Policy", "no-referrer"}}};
  for (const auto& [name, value] : headers) {
    MHD_add_response_header(response, name, value);
  }
  bool says_caching = false;
  for (const auto& [name, value] : answer.headers) {
    MHD_add_response_header(response, name.c_str(), value.c_str());
    says_caching = says_caching || name == MHD_HTTP_HEADER_CACHE_CONTROL;
  }
  if (!says_caching) {
    MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
  }
  if (answer.status == MHD_HTTP_METHOD_NOT_ALLOWED) {
    MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
  }
  if (answer.status == MHD_HTTP_SERVICE_UNAVAILABLE) {
    MHD_add_response_header(response, MHD_HTTP_HEADER_RETRY_AFTER, "1");
  }
}

std::string host_of(const PeerAddress& address) {
  return address.text.substr(0, address.text.rfind(':'));
}

std::vector<bool> who_is_gone(const std::vector<int>& descriptors) {
  std::vector<pollfd> items;
  for (const int descriptor : descriptors) {
    items.push_back({descriptor, POLLRDHUP, 0});
  }
  std::vector<bool> gone(descriptors.size());
  if (!items.empty() && ::poll(items.data(), items.size(), 0) > 0) {
    std::transform(items.begin(), items.end(), gone.begin(),
                   [](const pollfd& item) { return item.revents != 0; });
  }
  return gone;
}

}  // namespace oblique::server
