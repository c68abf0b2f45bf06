#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// Descriptor by which a reader process gets queries and answers them.
inline constexpr int kReaderChannel = 3;

/// What starts a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// Bytes on the channel are frames, each behind its length. A query is an encoded QueryRequest, its
/// answer the bytes of a ClientReply without request_id.
using FrameLength = std::uint32_t;

/// The bytes of a ClientReply that says why a query has no answer.
std::string encoded_error(const std::string& message, bool wrong_request = false);

/// A reader process: answers the queries on the database at `path` that come by `kReaderChannel`,
/// one after another, until that is closed. Bounds its own memory, files and processor time first,
/// and dies with the thread that started it. Gives the exit code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
