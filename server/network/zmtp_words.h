#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// What both ends of ZMTP 3 say in so many bytes (rfc.zeromq.org 23 and 37).
namespace oblique::server {

// Bits of a frame's first byte.
inline constexpr unsigned kFrameMore = 1;
inline constexpr unsigned kFrameLong = 2;
inline constexpr unsigned kFrameCommand = 4;

inline constexpr std::size_t kGreetingBytes = 64;
inline constexpr std::size_t kMechanismAt = 12;
inline constexpr std::size_t kMechanismBytes = 20;
inline constexpr unsigned char kOldestVersion = 3;

/// "NULL" or "CURVE" as a greeting has it, padded.
std::string padded_mechanism(std::string_view name);
/// The server's greeting.
std::string greeting_of(std::string_view mechanism);
/// What goes before the body of a message of one frame.
std::string zmtp_header(std::size_t body_bytes);
/// A command as a frame.
std::string command_of(std::string_view name, std::string_view data);
/// What the server says of itself in READY.
std::string own_properties();

/// Why a peer with these properties cannot be spoken with; empty: it can.
std::string objection_to_properties(std::string_view properties);

}  // namespace oblique::server
