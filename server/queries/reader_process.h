#pragma once

#include <cstddef>
#include <string>

#include <sys/types.h>

#include "server/queries/reader_program.h"

namespace oblique::server {

/// One frame of an answer; see AnswerHead.
struct ReaderAnswer {
  AnswerHead head;
  std::string reply;
};

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
  /// Moves bytes both ways as far as they go without waiting, until a frame of the answer has come.
  /// Throws std::bad_alloc.
  State advance();
  State state() const { return state_; }
  /// What stands before that frame.
  AnswerHead head() const;
  /// That frame, once. Until it is taken the process is read no further, and so soon stands still.
  ReaderAnswer take_answer();

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
  bool look_for_frame();

  int channel_ = -1;
  pid_t pid_ = -1;
  bool gone_ = false;
  int status_ = 0;  ///< as waitpid tells it, once gone
  State state_ = State::kIdle;
  std::string out_;
  std::size_t sent_ = 0;  ///< of out_
  std::string in_;        ///< what has come of the answer and was not taken
};

}  // namespace oblique::server
