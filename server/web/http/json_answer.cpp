#include "server/web/http/json_answer.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace oblique::server {
namespace {

std::string text_of(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

HttpAnswer json_answer(const nlohmann::ordered_json& value, unsigned status) {
  return {status, "application/json", text_of(value) + "\n"};
}

HttpAnswer error_answer(unsigned status, const std::string& sentence) {
  return json_answer({{"error", sentence}}, status);
}

HttpAnswer numbers_answer(const nlohmann::ordered_json& head, const std::string& numbers) {
  constexpr std::size_t kLengthBytes = 4;
  constexpr std::size_t kAlignment = 8;
  constexpr unsigned kBitsOfByte = 8;
  std::string text = text_of(head);
  text.append((kAlignment - (kLengthBytes + text.size()) % kAlignment) % kAlignment, ' ');
  std::string body;
  body.reserve(kLengthBytes + text.size() + numbers.size());
  for (unsigned byte = 0; byte < kLengthBytes; ++byte) {
    body += static_cast<char>((text.size() >> (kBitsOfByte * byte)) & 0xffU);
  }
  body += text;
  body += numbers;
  return {200, "application/octet-stream", std::move(body)};
}

}  // namespace oblique::server
