#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <sys/types.h>

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
/// until the channel is closed. First limits its own memory and files. Is killed when the thread
/// that started it ends. Returns the exit code.
int run_reader_program(const std::string& path);

/// A reader process, as the server sees it. It is killed when this is destroyed and when the thread
/// that created this ends.
class ReaderProcess {
 public:
  /// Starts `program` for the database at `path`. Throws std::system_error.
  ReaderProcess(const std::string& program, const std::string& path);
  ~ReaderProcess();
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;

  /// Sends a query, an encoded QueryRequest. The previous answer must have been read to its end.
  void ask(const std::string& request);

  struct Frame {
    std::string reply;  ///< an encoded ClientReply without request_id
    bool is_last;
  };
  /// Sends and receives as many bytes as possible without waiting. Returns the next frame of the
  /// answer once it is complete. The process blocks while its frames are not read.
  std::optional<Frame> read();
  /// Whether the process has closed its end or sent a frame that is too long. Set by `read`.
  bool is_broken() const { return is_broken_; }

  /// To be polled for `events()` before the next `read`.
  int descriptor() const { return channel_; }
  short events() const;

  void kill();

 private:
  bool receive_some();

  int channel_ = -1;
  pid_t pid_ = -1;
  bool is_broken_ = false;
  std::string out_;  ///< bytes to send
  std::string in_;   ///< received bytes of frames that were not returned yet
};

}  // namespace oblique::server
