#include "server/network/zmtp.h"

#include <algorithm>
#include <array>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMechanismAt = 12;
constexpr std::size_t kMechanismBytes = 20;
constexpr std::size_t kAsServerAt = 32;
constexpr unsigned char kMajorVersion = 3;
constexpr std::size_t kLongestShortFrame = 255;
/// Maximum size of a command. READY has about 50 bytes; INITIATE 300, plus up to 255 for an
/// identity.
constexpr std::uint64_t kLongestCommand = 4096;
constexpr const char* kCutOff = "its properties are cut off";

unsigned char byte_at(std::string_view bytes, std::size_t index) {
  return static_cast<unsigned char>(bytes[index]);
}

std::string header_of(std::size_t body_bytes, unsigned flags) {
  if (body_bytes <= kLongestShortFrame) {
    return {static_cast<char>(flags), static_cast<char>(body_bytes)};
  }
  return static_cast<char>(flags | kFrameLong) + big_endian_of(body_bytes);
}

/// Returns the properties that the server sends in READY.
std::string own_properties() {
  return "\x0bSocket-Type" + std::string("\0\0\0\x06", 4) + "ROUTER";
}

std::string validate_properties(std::string_view properties) {
  constexpr std::size_t kLengthBytes = 4;
  constexpr std::array<std::string_view, 2> kAllowed{"DEALER", "ROUTER"};
  std::string_view socket_type;
  while (!properties.empty()) {
    const std::size_t name_bytes = byte_at(properties, 0);
    if (properties.size() < 1 + name_bytes + kLengthBytes) {
      return kCutOff;
    }
    const std::string_view name = properties.substr(1, name_bytes);
    const auto value_bytes =
        static_cast<std::size_t>(number_of(properties.substr(1 + name_bytes, kLengthBytes)));
    properties.remove_prefix(1 + name_bytes + kLengthBytes);
    if (properties.size() < value_bytes) {
      return kCutOff;
    }
    if (name == "Socket-Type") {
      socket_type = properties.substr(0, value_bytes);
    }
    properties.remove_prefix(value_bytes);
  }
  return std::find(kAllowed.begin(), kAllowed.end(), socket_type) == kAllowed.end()
             ? "its socket type cannot connect to a ROUTER"
             : "";
}

}  // namespace

std::string greeting_of(std::string_view mechanism) {
  constexpr char kMinorVersion = 1;
  std::string bytes(kGreetingBytes, '\0');
  bytes[0] = '\xff';
  bytes[9] = '\x7f';
  bytes[10] = static_cast<char>(kMajorVersion);
  bytes[11] = kMinorVersion;
  bytes[kAsServerAt] = mechanism == "NULL" ? '\0' : '\1';
  return bytes.replace(kMechanismAt, mechanism.size(), mechanism);
}

std::string message_header(std::size_t body_bytes) {
  return header_of(body_bytes, 0);
}

std::string command_frame(std::string_view name, std::string_view data) {
  std::string bytes = header_of(1 + name.size() + data.size(), kFrameCommand);
  bytes += static_cast<char>(name.size());
  return bytes.append(name).append(data);
}

struct Zmtp::Header {
  std::size_t bytes;
  std::uint64_t body_bytes;
  bool is_command;
};

Zmtp::Zmtp(const PortSecurity* security)
    : curve_(security == nullptr ? nullptr : std::make_unique<CurveHandshake>(*security)),
      answers_(greeting_of(security == nullptr ? "NULL" : "CURVE")) {}

void Zmtp::receive(std::string_view bytes) {
  buffer_ += bytes;
  advance();
}

std::string Zmtp::take_message() {
  std::string message = std::move(*message_);
  message_.reset();
  advance();
  return message;
}

std::string Zmtp::take_answers() {
  return std::exchange(answers_, {});
}

std::string Zmtp::begin_message(std::string_view& body) {
  if (!curve_) {
    return message_header(body.size());
  }
  std::string frame = message_header(CurveSession::kAddedBytes + body.size());
  frame.reserve(frame.size() + CurveSession::kAddedBytes + body.size());
  curve_->session().seal(body, frame);
  body = {};
  return frame;
}

std::shared_ptr<const KeyIdentity> Zmtp::identity() const {
  return curve_ ? curve_->identity() : nullptr;
}

void Zmtp::fail(std::string reason, RefusalCause cause) {
  fault_ = {cause, std::move(reason)};
  if (curve_ && state_ == State::kHandshake) {
    const std::string_view code = error_code(cause);
    answers_ += command_frame("ERROR", std::string(1, static_cast<char>(code.size())).append(code));
  }
}

void Zmtp::advance() {
  constexpr std::size_t kCompactFrom = 64 * 1024;
  constexpr std::size_t kKeptCapacity = 4 * 1024;
  while (fault_.reason.empty() && !message_ && pending_step_ == PendingStep::kNone &&
         (state_ == State::kGreeting ? take_greeting() : take_frame())) {
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

/// Reads the peer's greeting. Returns true if it is complete. A wrong byte causes a fault at once.
bool Zmtp::take_greeting() {
  const std::string_view bytes = pending();
  const auto is_wrong = [&](std::size_t at, auto&& is_right) {
    return bytes.size() > at && !is_right(byte_at(bytes, at));
  };
  if (is_wrong(0, [](unsigned byte) { return byte == 0xffU; }) ||
      is_wrong(9, [](unsigned byte) { return byte == 0x7fU; }) ||
      is_wrong(10, [](unsigned byte) { return byte >= kMajorVersion; })) {
    fail("it does not use ZMTP 3");
    return false;
  }
  if (bytes.size() < kGreetingBytes) {
    return false;
  }
  const std::string own = greeting_of(curve_ ? "CURVE" : "NULL");
  if (bytes.substr(kMechanismAt, kMechanismBytes) != own.substr(kMechanismAt, kMechanismBytes)) {
    fail(curve_ ? "it has no key, but this server needs one"
                : "it has a key, but this server runs without keys",
         RefusalCause::kOtherMechanism);
    return false;
  }
  begin_ += kGreetingBytes;
  state_ = State::kHandshake;
  if (!curve_) {
    answers_ += command_frame("READY", own_properties());
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
  if (flags > (kFrameMore | kFrameLong | kFrameCommand)) {
    fail("it sends a frame of an unknown kind");
    return std::nullopt;
  }
  if ((flags & kFrameMore) != 0) {
    fail("it sends a message of several frames");
    return std::nullopt;
  }
  Header header{(flags & kFrameLong) != 0 ? kLongBytes : kShortBytes, 0,
                (flags & kFrameCommand) != 0};
  if (bytes.size() < header.bytes) {
    return std::nullopt;
  }
  header.body_bytes = number_of(bytes.substr(1, header.bytes - 1));
  const bool is_message = !header.is_command || (curve_ && is_open());
  const std::uint64_t longest =
      is_message ? protocol::kMaxFrameBytes + (curve_ ? CurveSession::kAddedBytes : 0)
                 : kLongestCommand;
  if (header.body_bytes > longest) {
    fail("it sends a frame of " + std::to_string(header.body_bytes) + " bytes; the limit is " +
         std::to_string(longest));
    return std::nullopt;
  }
  return header;
}

bool Zmtp::take_frame() {
  const std::optional<Header> header = next_header();
  if (!header) {
    return false;
  }
  if (!header->is_command && !is_open()) {
    fail("it sends a message before the handshake is done");
    return false;
  }
  if (header->is_command && is_open() && !curve_) {
    fail("it sends a command (for example a ZMTP heartbeat) after the handshake");
    return false;
  }
  if (pending().size() - header->bytes < header->body_bytes) {
    return false;
  }
  if (curve_) {
    pending_step_ = is_open() ? PendingStep::kSealedFrame : PendingStep::kHandshake;
    return false;
  }
  const std::string_view body =
      pending().substr(header->bytes, static_cast<std::size_t>(header->body_bytes));
  if (header->is_command) {
    take_command(body);
  } else {
    message_ = std::string(body);
  }
  begin_ += header->bytes + body.size();
  return true;
}

void Zmtp::run_step() {
  if (pending_step_ == PendingStep::kNone) {
    return;
  }
  const Header header = *next_header();
  const std::string_view body =
      pending().substr(header.bytes, static_cast<std::size_t>(header.body_bytes));
  if (pending_step_ == PendingStep::kHandshake) {
    take_command(body);
  } else {
    message_ = curve_->session().open(body);
    if (!message_) {
      fail(
          "it sends a frame that is not encrypted with its keys, is a repetition, or is not a "
          "message of "
          "one frame");
    }
  }
  begin_ += header.bytes + body.size();
  pending_step_ = PendingStep::kNone;
  advance();
}

void Zmtp::take_command(std::string_view body) {
  const std::size_t name_bytes = body.empty() ? 0 : byte_at(body, 0);
  if (name_bytes == 0 || body.size() < 1 + name_bytes) {
    fail("it sends a command without a name");
    return;
  }
  const std::string_view name = body.substr(1, name_bytes);
  const std::string_view data = body.substr(1 + name_bytes);
  if (curve_) {
    CurveHandshake::Outcome outcome = curve_->take(name, data);
    if (auto* const refusal = std::get_if<Refusal>(&outcome)) {
      fail(std::move(refusal->reason), refusal->cause);
    } else if (const auto& answer = std::get<std::string>(outcome); !curve_->is_done()) {
      answers_ += command_frame("WELCOME", answer);
    } else if (take_properties(answer)) {
      answers_ += command_frame("READY", curve_->session().ready(own_properties()));
    }
  } else if (name == "READY") {
    take_properties(data);
  } else {
    fail("its handshake does not begin with READY");
  }
}

/// Validates the peer's properties and opens the connection. Returns false if they are invalid.
bool Zmtp::take_properties(std::string_view properties) {
  std::string fault = validate_properties(properties);
  if (!fault.empty()) {
    fail(std::move(fault));
    return false;
  }
  state_ = State::kOpen;
  return true;
}

}  // namespace oblique::server
