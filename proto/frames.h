#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <google/protobuf/message_lite.h>

namespace oblique::protocol {

/// Version spoken here. A hello with another one is refused with both numbers in the reason.
inline constexpr std::uint32_t kProtocolVersion = 1;

/// Largest frame that either side takes; a longer one is a foreign or broken peer.
inline constexpr std::size_t kMaxFrameBytes = std::size_t{16} * 1024 * 1024;

/// Serialises a message into one frame.
std::string encode(const google::protobuf::MessageLite& message);

/// Parses one frame. Every frame is hostile until this says otherwise: false for one that is too
/// long, truncated or foreign (no known kind set is the caller's to check).
bool decode(std::string_view frame, google::protobuf::MessageLite& message);

}  // namespace oblique::protocol
