#pragma once

#include <cstddef>
#include <string>

#include <sys/types.h>

namespace oblique::server {

/// One process that reads a database for this one, one query at a time; see reader_program.h. It is
/// killed when this is destroyed, when its owner says so, or when the thread that made this ends.
/// Nothing here waits for it, but for the destructor, a short time.
class ReaderProcess {
 public:
  /// Starts `program` for the database at `path`. Throws std::system_error.
  ReaderProcess(const std::string& program, const std::string& path);
  ~ReaderProcess();
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;

  /// Gives it a query, the bytes of a QueryRequest. Not before the last one was answered.
  void ask(const std::string& request);

  enum class State { kIdle, kWorking, kAnswered, kEnded };
  /// Moves bytes both ways as far as they go without waiting. Throws std::bad_alloc.
  State advance();
  /// The answer, once.
  std::string take_answer();

  /// To be polled for `events()` before the next `advance`; -1 when it has nothing more to say.
  int descriptor() const { return state_ == State::kEnded ? -1 : channel_; }
  short events() const;

  void kill();
  /// Whether the process has ended; after `kill` it soon has.
  bool is_gone();
  /// How it ended, as "was killed by signal 9 (Killed)"; only once it is gone.
  std::string ending() const;

 private:
  bool send_some();
  bool receive_some();

  int channel_ = -1;
  pid_t pid_ = -1;
  bool gone_ = false;
  int status_ = 0;  ///< as waitpid tells it, once gone
  State state_ = State::kIdle;
  std::string out_;
  std::size_t sent_ = 0;  ///< of out_
  std::string in_;        ///< the length and what has come of the answer
};

}  // namespace oblique::server
