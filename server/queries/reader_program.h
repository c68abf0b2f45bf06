#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// Descriptor by which a reader process gets queries and answers them.
inline constexpr int kReaderChannel = 3;

/// What starts a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// A query on the channel is an encoded QueryRequest behind its length.
using FrameLength = std::uint32_t;

/// Its answer is one or more frames, each behind this: the bytes of a ClientReply without
/// request_id. The last one ends the answer.
struct AnswerHead {
  std::uint32_t length;
  std::uint8_t ends;
  std::uint8_t can_go_on;  ///< the answer may be ended here and asked for again with what follows
  std::uint16_t reserved;
  std::int64_t last_point;
  std::uint64_t rows;
  std::uint64_t chunks;
};

/// The bytes of a ClientReply that says why a query has no answer.
std::string encoded_error(const std::string& message, bool wrong_request = false);

/// A reader process: answers the queries on the database at `path` that come by `kReaderChannel`,
/// one after another, until that is closed. Bounds its own memory, files and processor time first,
/// and dies with the thread that started it. Gives the exit code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
