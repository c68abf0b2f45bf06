#include "server/web/http/http_message.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace oblique::server {

std::vector<std::string> HttpRequest::all(const std::string& name) const {
  std::vector<std::string> values;
  const auto [begin, end] = headers.equal_range(name);
  for (auto at = begin; at != end; ++at) {
    values.push_back(at->second);
  }
  return values;
}

std::string HttpRequest::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string() : found->second;
}

std::string json_text(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

HttpAnswer text_answer(unsigned status, std::string_view sentence) {
  return {status, "text/plain; charset=utf-8", std::string(sentence) + "\n"};
}

HttpAnswer json_answer(const nlohmann::ordered_json& value, unsigned status) {
  return {status, "application/json", json_text(value) + "\n"};
}

HttpAnswer error_answer(unsigned status, const std::string& sentence) {
  return json_answer({{"error", sentence}}, status);
}

HttpAnswer numbers_answer(const nlohmann::ordered_json& head, const std::string& numbers) {
  constexpr std::size_t kAlignment = 8;
  std::string text = json_text(head);
  std::uint32_t length = 0;
  text.append((kAlignment - (sizeof length + text.size()) % kAlignment) % kAlignment, ' ');
  length = static_cast<std::uint32_t>(text.size());
  std::string body(sizeof length, '\0');
  std::memcpy(body.data(), &length, sizeof length);
  body += text;
  body += numbers;
  return {200, "application/octet-stream", std::move(body)};
}

}  // namespace oblique::server
