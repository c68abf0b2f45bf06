#include "server/network/zmtp.h"

#include <algorithm>
#include <array>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

constexpr std::size_t kGreetingBytes = 64;
constexpr std::size_t kMechanismAt = 12;
constexpr std::size_t kMechanismBytes = 20;
constexpr unsigned char kVersionMajor = 3;
constexpr unsigned char kVersionMinor = 1;
/// A sound peer's READY has some 50 bytes, and 255 more with an identity.
constexpr std::uint64_t kLongestCommand = 4096;
constexpr std::size_t kLongestPingContext = 16;
constexpr std::size_t kPingTimeToLiveBytes = 2;

// Bits of a frame's first byte.
constexpr unsigned kMore = 1;
constexpr unsigned kLong = 2;
constexpr unsigned kCommand = 4;

unsigned char byte_at(std::string_view bytes, std::size_t index) {
  return static_cast<unsigned char>(bytes[index]);
}

std::string padded_mechanism() {
  std::string name = "NULL";
  name.resize(kMechanismBytes, '\0');
  return name;
}

std::string greeting() {
  std::string bytes(kGreetingBytes, '\0');
  bytes[0] = '\xff';
  bytes[9] = '\x7f';
  bytes[10] = static_cast<char>(kVersionMajor);
  bytes[11] = static_cast<char>(kVersionMinor);
  return bytes.replace(kMechanismAt, kMechanismBytes, padded_mechanism());
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) {
    value = value << 8U | static_cast<unsigned char>(byte);
  }
  return value;
}

/// A command of at most 255 bytes.
std::string command(std::string_view name, std::string_view data) {
  std::string bytes;
  bytes += static_cast<char>(kCommand);
  bytes += static_cast<char>(1 + name.size() + data.size());
  bytes += static_cast<char>(name.size());
  bytes += name;
  return bytes += data;
}

std::string ready() {
  constexpr std::string_view kName = "Socket-Type";
  constexpr std::string_view kValue = "ROUTER";
  std::string property;
  property += static_cast<char>(kName.size());
  property += kName;
  property += std::string("\0\0\0", 3);
  property += static_cast<char>(kValue.size());
  return command("READY", property += kValue);
}

}  // namespace

struct Zmtp::Header {
  std::size_t bytes;
  std::uint64_t body_bytes;
  bool more;
  bool is_command;
};

std::string zmtp_header(std::size_t body_bytes) {
  constexpr std::size_t kLongestShort = 255;
  std::string header;
  if (body_bytes <= kLongestShort) {
    header += '\0';
    return header += static_cast<char>(body_bytes);
  }
  header += static_cast<char>(kLong);
  for (unsigned shift = 64; shift > 0;) {
    shift -= 8;
    header += static_cast<char>(body_bytes >> shift & 0xffU);
  }
  return header;
}

Zmtp::Zmtp() : answers_(greeting()) {}

void Zmtp::receive(std::string_view bytes) {
  buffer_ += bytes;
  advance();
}

ZmtpMessage Zmtp::take_message() {
  ZmtpMessage message = std::move(*message_);
  message_.reset();
  advance();
  return message;
}

std::string Zmtp::take_answers() {
  return std::exchange(answers_, {});
}

void Zmtp::advance() {
  constexpr std::size_t kCompactFrom = 64 * 1024;
  constexpr std::size_t kKeptCapacity = 4 * 1024;
  while (fault_.empty() && !message_ &&
         (state_ == State::kGreeting ? take_greeting() : discard() && take_frame())) {
  }
  if (begin_ == buffer_.size()) {
    begin_ = 0;
    buffer_.clear();
    if (buffer_.capacity() > kKeptCapacity) {
      buffer_.shrink_to_fit();
    }
  } else if (begin_ >= kCompactFrom) {
    buffer_.erase(0, std::exchange(begin_, 0));
  }
}

/// True when it was taken whole. A stranger is noticed at its first bytes.
bool Zmtp::take_greeting() {
  const std::string_view bytes = pending();
  const auto differs = [&](std::size_t at, auto&& is_right) {
    return bytes.size() > at && !is_right(byte_at(bytes, at));
  };
  if (differs(0, [](unsigned byte) { return byte == 0xffU; }) ||
      differs(9, [](unsigned byte) { return byte == 0x7fU; }) ||
      differs(10, [](unsigned byte) { return byte >= kVersionMajor; })) {
    fault_ = "it does not speak ZMTP 3";
    return false;
  }
  if (bytes.size() < kGreetingBytes) {
    return false;
  }
  if (bytes.substr(kMechanismAt, kMechanismBytes) != padded_mechanism()) {
    fault_ = "it asks for another security mechanism than NULL";
    return false;
  }
  begin_ += kGreetingBytes;
  state_ = State::kHandshake;
  answers_ += ready();
  return true;
}

/// Drops what has come of a frame that is not kept; false while some of it is still to come.
bool Zmtp::discard() {
  const std::size_t dropped =
      static_cast<std::size_t>(std::min<std::uint64_t>(discard_bytes_, pending().size()));
  begin_ += dropped;
  discard_bytes_ -= dropped;
  if (discard_bytes_ > 0) {
    return false;
  }
  if (in_multipart_ && !more_follow_) {
    in_multipart_ = false;
    message_ = ZmtpMessage{{}, false};
    return false;
  }
  return true;
}

std::optional<Zmtp::Header> Zmtp::next_header() {
  constexpr std::size_t kShortBytes = 2;
  constexpr std::size_t kLongBytes = 9;
  const std::string_view bytes = pending();
  if (bytes.empty()) {
    return std::nullopt;
  }
  const unsigned flags = byte_at(bytes, 0);
  const bool is_long = (flags & kLong) != 0;
  Header header{is_long ? kLongBytes : kShortBytes, 0, (flags & kMore) != 0,
                (flags & kCommand) != 0};
  if (flags > (kMore | kLong | kCommand) || (header.more && header.is_command)) {
    fault_ = "it sends a frame of no known kind";
    return std::nullopt;
  }
  if (bytes.size() < header.bytes) {
    return std::nullopt;
  }
  header.body_bytes = big_endian(bytes.substr(1, header.bytes - 1));
  if (header.body_bytes > (header.is_command ? kLongestCommand : protocol::kMaxFrameBytes)) {
    fault_ = "it sends a frame of " + std::to_string(header.body_bytes) + " bytes";
    return std::nullopt;
  }
  return header;
}

bool Zmtp::take_frame() {
  const std::optional<Header> header = next_header();
  if (!header) {
    return false;
  }
  if (!header->is_command && state_ == State::kHandshake) {
    fault_ = "it sends a message before READY";
    return false;
  }
  if (!header->is_command && (header->more || in_multipart_)) {
    begin_ += header->bytes;
    discard_bytes_ = header->body_bytes;
    more_follow_ = header->more;
    in_multipart_ = true;
    return true;
  }
  if (pending().size() - header->bytes < header->body_bytes) {
    return false;
  }
  const std::string_view body =
      pending().substr(header->bytes, static_cast<std::size_t>(header->body_bytes));
  if (header->is_command) {
    take_command(body);
  } else {
    message_ = ZmtpMessage{std::string(body), true};
  }
  begin_ += header->bytes + body.size();
  return true;
}

void Zmtp::take_command(std::string_view body) {
  const std::size_t name_bytes = body.empty() ? 0 : byte_at(body, 0);
  if (name_bytes == 0 || body.size() < 1 + name_bytes) {
    fault_ = "it sends a command without a name";
    return;
  }
  const std::string_view name = body.substr(1, name_bytes);
  const std::string_view data = body.substr(1 + name_bytes);
  if (state_ == State::kHandshake) {
    if (name == "READY") {
      take_ready(data);
    } else {
      fault_ = "it does not say READY";
    }
  } else if (name == "PING") {
    answer_ping(data);
  }  // others are for other kinds of sockets
}

void Zmtp::take_ready(std::string_view properties) {
  constexpr std::size_t kLengthBytes = 4;
  std::string socket_type;
  while (!properties.empty()) {
    const std::size_t name_bytes = byte_at(properties, 0);
    if (properties.size() < 1 + name_bytes + kLengthBytes) {
      fault_ = "its READY is cut off";
      return;
    }
    const std::string_view name = properties.substr(1, name_bytes);
    const std::uint64_t value_bytes = big_endian(properties.substr(1 + name_bytes, kLengthBytes));
    properties.remove_prefix(1 + name_bytes + kLengthBytes);
    if (properties.size() < value_bytes) {
      fault_ = "its READY is cut off";
      return;
    }
    if (name == "Socket-Type") {
      socket_type = properties.substr(0, static_cast<std::size_t>(value_bytes));
    }
    properties.remove_prefix(static_cast<std::size_t>(value_bytes));
  }
  constexpr std::array<std::string_view, 3> kAllowed{"DEALER", "REQ", "ROUTER"};
  if (std::find(kAllowed.begin(), kAllowed.end(), socket_type) == kAllowed.end()) {
    fault_ = "its socket is of a kind that does not speak with a ROUTER";
    return;
  }
  state_ = State::kOpen;
}

/// Earlier releases' sockets find out by PING whether the server lives.
void Zmtp::answer_ping(std::string_view arguments) {
  if (arguments.size() < kPingTimeToLiveBytes) {
    fault_ = "its PING is cut off";
    return;
  }
  answers_ += command("PONG", arguments.substr(kPingTimeToLiveBytes, kLongestPingContext));
}

}  // namespace oblique::server
