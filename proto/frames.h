#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <google/protobuf/message_lite.h>

namespace oblique::protocol {

/// Peers of any other version are refused with both numbers in the reason.
inline constexpr std::uint32_t kProtocolVersion = 8;

/// Largest frame that either side takes; a longer one is a foreign or broken peer.
inline constexpr std::size_t kMaxFrameBytes = std::size_t{16} * 1024 * 1024;

/// Why the server refuses a `who` ("worker", "client") of that version, or an empty text.
std::string version_error(std::uint32_t version, const std::string& who);

/// Serialises a message into one frame.
std::string encode(const google::protobuf::MessageLite& message);

/// The frame of `rest` with the field `number`, a message that is encoded already and is not
/// parsed.
std::string encode_around(const google::protobuf::MessageLite& rest, int number,
                          std::string_view encoded);

/// Parses one frame. Every frame is hostile until this says otherwise: false for one that is too
/// long, truncated or foreign (no known kind set is the caller's to check).
bool decode(std::string_view frame, google::protobuf::MessageLite& message);

/// For main functions: keeps Protobuf from writing a line to standard error for each hostile frame,
/// which would let a peer fill the log. Whoever decodes frames counts them instead.
void silence_protobuf();

}  // namespace oblique::protocol
