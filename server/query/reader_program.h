#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// Descriptor by which a reader process receives queries and sends answers.
inline constexpr int kReaderChannel = 3;

/// Argument that makes oblique-server a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// Precedes each frame on the channel. A query is one frame, an encoded QueryRequest. Its answer is
/// one frame or more, each an encoded ClientReply without request_id.
struct FrameHead {
  std::uint32_t length;
  std::uint32_t is_last;  ///< 1 in the last frame of an answer
};

/// Encodes a ClientReply with an error.
std::string encoded_error(const std::string& message, bool wrong_request = false);

/// Main function of a reader process: answers queries on the database at `path` one after another,
/// until the channel is closed. First limits its own memory, files and processor time. Is killed
/// when the thread that started it ends. Returns the exit code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
