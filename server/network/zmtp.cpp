#include "server/network/zmtp.h"

#include <algorithm>
#include <utility>

#include "proto/frames.h"
#include "server/network/curve/bytes.h"

namespace oblique::server {
namespace {

/// A sound peer's READY has some 50 bytes, its INITIATE some 300, and 255 more with an identity.
constexpr std::uint64_t kLongestCommand = 4096;
constexpr std::size_t kLongestPingContext = 16;
constexpr std::size_t kPingTimeToLiveBytes = 2;

unsigned char byte_at(std::string_view bytes, std::size_t index) {
  return static_cast<unsigned char>(bytes[index]);
}

}  // namespace

struct Zmtp::Header {
  std::size_t bytes;
  std::uint64_t body_bytes;
  bool more;
  bool is_command;
};

Zmtp::Zmtp(const PortGuard* guard)
    : curve_(guard == nullptr ? nullptr : std::make_unique<CurvePeer>(*guard)),
      answers_(greeting_of(guard == nullptr ? "NULL" : "CURVE")) {}

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

std::string Zmtp::header_or_sealed(std::string_view body) {
  if (!curve_) {
    return zmtp_header(body.size());
  }
  std::string frame = zmtp_header(CurveTraffic::kAddedBytes + body.size());
  frame.reserve(frame.size() + CurveTraffic::kAddedBytes + body.size());
  curve_->traffic().seal(body, false, frame);
  return frame;
}

std::shared_ptr<const KeyHolder> Zmtp::holder() const {
  return curve_ ? curve_->holder() : nullptr;
}

void Zmtp::fail(RefusalCause cause, std::string reason) {
  fault_ = {cause, std::move(reason)};
  if (curve_ && state_ == State::kHandshake) {
    const std::string_view code = error_code(cause);
    answers_ += command_of("ERROR", std::string(1, static_cast<char>(code.size())).append(code));
  }
}

void Zmtp::advance() {
  constexpr std::size_t kCompactFrom = 64 * 1024;
  constexpr std::size_t kKeptCapacity = 4 * 1024;
  while (fault_.reason.empty() && !message_ && work_ == Work::kNone &&
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
      differs(10, [](unsigned byte) { return byte >= kOldestVersion; })) {
    fail(RefusalCause::kFaulty, "it does not speak ZMTP 3");
    return false;
  }
  if (bytes.size() < kGreetingBytes) {
    return false;
  }
  if (bytes.substr(kMechanismAt, kMechanismBytes) != padded_mechanism(curve_ ? "CURVE" : "NULL")) {
    fail(RefusalCause::kOtherMechanism, curve_ ? "it has no key, and one is needed here"
                                               : "it asks for keys, and the server has none");
    return false;
  }
  begin_ += kGreetingBytes;
  state_ = State::kHandshake;
  if (!curve_) {
    answers_ += command_of("READY", own_properties());
  }
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
  if (!curve_ && in_multipart_ && !more_follow_) {
    in_multipart_ = false;
    message_ = ZmtpMessage{{}, false};
    return false;
  }
  return true;
}

std::uint64_t Zmtp::longest(const Header& header) const {
  if (curve_ && state_ == State::kOpen) {
    return protocol::kMaxFrameBytes + CurveTraffic::kAddedBytes;
  }
  return header.is_command ? kLongestCommand : protocol::kMaxFrameBytes;
}

std::optional<Zmtp::Header> Zmtp::next_header() {
  constexpr std::size_t kShortBytes = 2;
  constexpr std::size_t kLongBytes = 9;
  const std::string_view bytes = pending();
  if (bytes.empty()) {
    return std::nullopt;
  }
  const unsigned flags = byte_at(bytes, 0);
  const bool is_long = (flags & kFrameLong) != 0;
  Header header{is_long ? kLongBytes : kShortBytes, 0, (flags & kFrameMore) != 0,
                (flags & kFrameCommand) != 0};
  // What is sealed says inside whether more follows.
  if (flags > (kFrameMore | kFrameLong | kFrameCommand) ||
      (header.more && (header.is_command || curve_))) {
    fail(RefusalCause::kFaulty, "it sends a frame of no known kind");
    return std::nullopt;
  }
  if (bytes.size() < header.bytes) {
    return std::nullopt;
  }
  header.body_bytes = number_of(bytes.substr(1, header.bytes - 1));
  if (header.body_bytes > longest(header)) {
    fail(RefusalCause::kFaulty,
         "it sends a frame of " + std::to_string(header.body_bytes) + " bytes");
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
    fail(RefusalCause::kFaulty, "it sends a message before the handshake is done");
    return false;
  }
  if (!header->is_command && !curve_ && (header->more || in_multipart_)) {
    begin_ += header->bytes;
    discard_bytes_ = header->body_bytes;
    more_follow_ = header->more;
    in_multipart_ = true;
    return true;
  }
  if (pending().size() - header->bytes < header->body_bytes) {
    return false;
  }
  if (curve_) {
    work_ = state_ == State::kHandshake ? Work::kHandshake : Work::kSealedFrame;
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

void Zmtp::do_work() {
  if (work_ == Work::kNone) {
    return;
  }
  const Header header = *next_header();
  const std::string_view body =
      pending().substr(header.bytes, static_cast<std::size_t>(header.body_bytes));
  if (work_ == Work::kHandshake) {
    take_command(body);
  } else {
    take_sealed(body);
  }
  begin_ += header.bytes + body.size();
  work_ = Work::kNone;
  advance();
}

void Zmtp::take_command(std::string_view body) {
  const std::size_t name_bytes = body.empty() ? 0 : byte_at(body, 0);
  if (name_bytes == 0 || body.size() < 1 + name_bytes) {
    fail(RefusalCause::kFaulty, "it sends a command without a name");
    return;
  }
  const std::string_view name = body.substr(1, name_bytes);
  const std::string_view data = body.substr(1 + name_bytes);
  if (state_ == State::kHandshake) {
    take_handshake(name, data);
  } else if (name == "PING") {
    answer_ping(data);
  }  // others are for other kinds of sockets
}

void Zmtp::take_handshake(std::string_view name, std::string_view data) {
  if (curve_) {
    take_curve_step(name, data);
  } else if (name == "READY") {
    take_properties(data);
  } else {
    fail(RefusalCause::kFaulty, "it does not say READY");
  }
}

void Zmtp::take_curve_step(std::string_view name, std::string_view data) {
  CurvePeer::Outcome outcome = curve_->take(name, data);
  if (auto* const refusal = std::get_if<Refusal>(&outcome)) {
    fail(refusal->cause, std::move(refusal->reason));
    return;
  }
  const std::string& said = std::get<std::string>(outcome);
  if (!curve_->is_admitted()) {
    answers_ += command_of("WELCOME", said);
    return;
  }
  take_properties(said);
  if (is_open()) {
    answers_ += command_of("READY", curve_->traffic().ready(own_properties()));
  }
}

void Zmtp::take_properties(std::string_view properties) {
  std::string objection = objection_to_properties(properties);
  if (objection.empty()) {
    state_ = State::kOpen;
  } else {
    fail(RefusalCause::kFaulty, std::move(objection));
  }
}

void Zmtp::take_sealed(std::string_view message) {
  std::optional<OpenedFrame> frame = curve_->traffic().open(message);
  if (!frame) {
    fail(RefusalCause::kFaulty, "it sends what is not sealed with its keys, or was said before");
  } else if (frame->is_command && frame->body.size() > kLongestCommand) {
    fail(RefusalCause::kFaulty,
         "it sends a command of " + std::to_string(frame->body.size()) + " bytes");
  } else if (frame->is_command) {
    take_command(frame->body);
  } else if (frame->more) {
    in_multipart_ = true;
  } else if (std::exchange(in_multipart_, false)) {
    message_ = ZmtpMessage{{}, false};
  } else {
    message_ = ZmtpMessage{std::move(frame->body), true};
  }
}

/// Earlier releases' sockets find out by PING whether the server lives.
void Zmtp::answer_ping(std::string_view arguments) {
  if (arguments.size() < kPingTimeToLiveBytes) {
    fail(RefusalCause::kFaulty, "its PING is cut off");
    return;
  }
  answer("PONG", arguments.substr(kPingTimeToLiveBytes, kLongestPingContext));
}

void Zmtp::answer(std::string_view name, std::string_view data) {
  if (!curve_) {
    answers_ += command_of(name, data);
    return;
  }
  const std::string body = std::string(1, static_cast<char>(name.size())).append(name).append(data);
  answers_ += zmtp_header(CurveTraffic::kAddedBytes + body.size());
  curve_->traffic().seal(body, true, answers_);
}

}  // namespace oblique::server
