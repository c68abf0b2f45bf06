#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <google/protobuf/message_lite.h>

namespace oblique::protocol {

/// Version of the protocol. A peer of another version is refused; the reason names both versions.
inline constexpr std::uint32_t kProtocolVersion = 9;

/// Maximum size of a frame that the server or a peer accepts [bytes].
inline constexpr std::size_t kMaxFrameBytes = std::size_t{16} * 1024 * 1024;

/// Returns why the server refuses a peer of this version, or an empty text. `who` is "worker" or
/// "client".
std::string version_error(std::uint32_t version, const std::string& who);

/// Encodes a message as one frame.
std::string encode(const google::protobuf::MessageLite& message);

/// Encodes `rest` and adds the field `number`. The field's value `encoded` is a message that is
/// already encoded; it is not parsed.
std::string encode_around(const google::protobuf::MessageLite& rest, int number,
                          std::string_view encoded);

/// Parses one frame, which may be malicious. Returns false if the frame is too long, truncated or
/// not of this type. The caller must check that the message has a kind which this version knows.
bool decode(std::string_view frame, google::protobuf::MessageLite& message);

/// Stops Protobuf from logging each frame that it cannot parse, because a peer could fill the log.
/// Code that decodes frames counts them instead. Must be called by main functions.
void silence_protobuf();

}  // namespace oblique::protocol
