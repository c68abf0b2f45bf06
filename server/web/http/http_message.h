#pragma once

#include <charconv>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include <microhttpd.h>
#include <nlohmann/json.hpp>

// HTTP requests and answers.
namespace oblique::server {

struct HttpRequest {
  std::string method;
  std::string path;  ///< without the query string
  /// decoded fields of the query string; of several fields with one name, the first
  std::map<std::string, std::string> fields;
  std::multimap<std::string, std::string> headers;  ///< header names in lower case
  std::string body;
  bool has_zero_bytes = false;  ///< true if a field contains a zero byte

  /// Returns all values of a header.
  std::vector<std::string> all(const std::string& name) const;
  /// Returns the first value of a header; empty if it is absent.
  std::string header(const std::string& name) const;
};

/// Returns the next bytes of an answer: empty if there are none yet, nothing at the end. Called on
/// the HTTP thread and again after each HttpServer::wake; destroyed when the connection ends. An
/// exception ends the connection.
using HttpStream = std::function<std::optional<std::string>()>;

struct HttpAnswer {
  unsigned status;  ///< MHD_HTTP_OK or another status
  std::string content_type;
  std::string body;
  /// headers in addition to those that every answer has
  std::vector<std::pair<std::string, std::string>> headers = {};
  HttpStream stream = {};                       ///< if set, replaces the body
  std::shared_ptr<const void> until_sent = {};  ///< kept until the body has been sent
};

/// Returns the answer when it is ready. Called on the HTTP thread and again after each
/// HttpServer::wake; destroyed when it has returned the answer or the client has disconnected.
using PendingAnswer = std::function<std::optional<HttpAnswer>()>;

using HttpOutcome = std::variant<HttpAnswer, PendingAnswer>;

/// Parses a text that consists of a single number; nothing for other texts.
template <typename Number>
std::optional<Number> read_number(const std::string& text) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

/// Returns an answer with a sentence as plain text.
HttpAnswer text_answer(unsigned status, std::string_view sentence);

HttpAnswer json_answer(const nlohmann::ordered_json& value, unsigned status = 200);

/// Returns an answer with the JSON {"error": sentence}.
HttpAnswer error_answer(unsigned status, const std::string& sentence);

/// Returns an answer with binary numbers. It consists of the length of the head in four bytes,
/// little endian; the head as JSON, padded with spaces so that the numbers begin at a multiple of
/// eight bytes; and the numbers.
HttpAnswer numbers_answer(const nlohmann::ordered_json& head, const std::string& numbers);

/// Formats JSON on one line; replaces bytes that are not UTF-8.
std::string json_text(const nlohmann::ordered_json& value);

}  // namespace oblique::server
