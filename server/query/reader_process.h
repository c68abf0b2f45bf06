#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include <sys/types.h>

namespace oblique::server {

/// A child process that answers one query at a time; see reader_program.h. It is killed when this
/// is destroyed and when the thread that created this ends. Only `end` and the destructor wait for
/// its end, and only for a short time.
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
  /// Whether the process has closed its end or sent invalid bytes. Set by `read`.
  bool is_broken() const { return is_broken_; }

  /// To be polled for `events()` before the next `read`.
  int descriptor() const { return channel_; }
  short events() const;

  void kill();
  /// Kills the process if needed and waits for its end. Returns a clause such as "ended with exit
  /// code 3".
  std::string end();

 private:
  bool send_some();
  bool receive_some();
  bool is_gone();

  int channel_ = -1;
  pid_t pid_ = -1;
  bool is_gone_ = false;
  int status_ = 0;  ///< as returned by waitpid, after the process ended
  bool is_broken_ = false;
  bool is_asked_ = false;  ///< a query was sent whose answer has not ended
  std::string out_;        ///< bytes to send
  std::string in_;         ///< received bytes of frames that were not returned yet
};

}  // namespace oblique::server
