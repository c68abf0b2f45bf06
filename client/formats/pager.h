#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>

#include "client/formats/sink.h"

namespace oblique::client {

/// The command line of the pager that people want: $OBLIQUE_PAGER, else $PAGER, else `less -FRSX`.
/// Empty where the first of these that is set is empty or `cat`.
std::string pager_command();

/// Standard output of a terminal: text of more than a screen goes through a pager, from its
/// beginning. To be ended by `finish`, or destroyed: both wait until the pager has been left.
/// Ctrl-C is the pager's meanwhile.
class PagedOutput : public Sink {
 public:
  /// `lines` fit on the screen; `command` as pager_command gives it.
  PagedOutput(std::size_t lines, std::string command);
  ~PagedOutput() override;

  void finish() override;
  /// Whether a pager was started.
  bool is_paged() const { return pager_ > 0; }

 protected:
  void write(std::string_view bytes) override;

 private:
  void start();
  void wait();

  std::size_t lines_left_;
  std::string command_;
  std::string first_;  // what fits on the screen so far
  pid_t pager_ = -1;   // 0: there is none to be started
  int pipe_ = -1;
};

}  // namespace oblique::client
