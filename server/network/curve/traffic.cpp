#include "server/network/curve/traffic.h"

#include "server/network/curve/bytes.h"

namespace oblique::server {
namespace {

constexpr std::string_view kMessageName = "\x07MESSAGE";
constexpr std::size_t kMessageHeaderBytes = kMessageName.size() + kCountedNonceBytes;
static_assert(CurveTraffic::kAddedBytes == kMessageHeaderBytes + kMacBytes + 1);

constexpr unsigned kSealedMore = 1;
constexpr unsigned kSealedCommand = 2;

std::string_view text_of(const std::array<char, kCountedNonceBytes>& bytes) {
  return {bytes.data(), bytes.size()};
}

}  // namespace

std::string CurveTraffic::ready(std::string_view properties) {
  const auto number = big_endian_of(++sent_nonce_);
  const CurveNonce nonce = curve_nonce("CurveZMQREADY---", text_of(number));
  std::string command(text_of(number));
  command.resize(kCountedNonceBytes + kMacBytes + properties.size());
  crypto_box_easy_afternm(raw(command.data() + kCountedNonceBytes), raw(properties),
                          properties.size(), nonce.data(), key_.data());
  return command;
}

void CurveTraffic::seal(std::string_view body, bool is_command, std::string& out) {
  const auto number = big_endian_of(++sent_nonce_);
  const CurveNonce nonce = curve_nonce("CurveZMQMESSAGES", text_of(number));
  out += kMessageName;
  out += text_of(number);
  const std::size_t mac_at = out.size();
  out.append(kMacBytes, '\0');
  out += static_cast<char>(is_command ? kSealedCommand : 0);
  out += body;
  std::uint8_t* const mac = raw(out.data() + mac_at);
  crypto_box_detached_afternm(mac + kMacBytes, mac, mac + kMacBytes, body.size() + 1, nonce.data(),
                              key_.data());
}

std::optional<OpenedFrame> CurveTraffic::open(std::string_view message) {
  if (message.size() < kAddedBytes || !message.starts_with(kMessageName)) {
    return std::nullopt;
  }
  const std::string_view number = message.substr(kMessageName.size(), kCountedNonceBytes);
  if (number_of(number) <= heard_nonce_) {
    return std::nullopt;
  }
  const CurveNonce nonce = curve_nonce("CurveZMQMESSAGEC", number);
  const std::uint8_t* const mac = raw(message.substr(kMessageHeaderBytes));
  OpenedFrame frame{false, false, std::string(message.substr(kMessageHeaderBytes + kMacBytes))};
  std::uint8_t* const text = raw(frame.body.data());
  if (crypto_box_open_detached_afternm(text, text, mac, frame.body.size(), nonce.data(),
                                       key_.data()) != 0) {
    return std::nullopt;
  }
  heard_nonce_ = number_of(number);
  const unsigned flags = text[0];
  if (flags > kSealedCommand) {
    return std::nullopt;
  }
  frame.more = flags == kSealedMore;
  frame.is_command = flags == kSealedCommand;
  frame.body.erase(0, 1);
  return frame;
}

}  // namespace oblique::server
