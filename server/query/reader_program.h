#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// Argument that makes oblique-server a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// Descriptor of a file with the query of a reader process, an encoded QueryRequest.
inline constexpr int kReaderRequest = 3;

/// Precedes each frame on the standard output of a reader process. The frames of an answer are
/// encoded ClientReply messages without request_id.
struct FrameHead {
  std::uint32_t length;
  std::uint32_t is_last;  ///< 1 in the last frame
};

/// Throws std::system_error with errno if a call of the system was not done.
void check_call(bool done, const char* what);

/// Encodes a ClientReply with an error.
std::string encoded_error(const std::string& message, bool wrong_request = false);

/// Main function of a reader process: answers one query on the database at `path`. First limits its
/// own memory and files. Is killed when the thread that started it ends. Returns the exit code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
