#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <google/protobuf/message_lite.h>

namespace oblique::protocol {

/// A peer of another version is refused; the reason names both versions.
inline constexpr std::uint32_t kProtocolVersion = 8;

/// Largest frame [bytes] that the server or a peer accepts.
inline constexpr std::size_t kMaxFrameBytes = std::size_t{16} * 1024 * 1024;

/// Why the server refuses a peer of this protocol version, or an empty text. `who` is "worker" or
/// "client".
std::string version_error(std::uint32_t version, const std::string& who);

/// Serialises a message into one frame.
std::string encode(const google::protobuf::MessageLite& message);

/// Encodes `rest` with the field `number`, whose value `encoded` is an already encoded message and
/// is not parsed.
std::string encode_around(const google::protobuf::MessageLite& rest, int number,
                          std::string_view encoded);

/// Parses one frame, which may be malicious. False if it is too long, truncated or not of this
/// type. The caller must check that a known kind is set.
bool decode(std::string_view frame, google::protobuf::MessageLite& message);

/// Keeps Protobuf from logging each frame that it cannot parse, which would let a peer fill the
/// log. Code that decodes frames counts these instead. Called by main functions.
void silence_protobuf();

}  // namespace oblique::protocol
