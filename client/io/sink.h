#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "client/io/child_process.h"

namespace oblique::client {

/// The reader of the output has ended, as `head` does. This is no failure and needs no message.
class ClosedPipe : public std::runtime_error {
 public:
  ClosedPipe() : std::runtime_error("the reader of the output has ended") {}
};

/// Receives the bytes of an output.
class Sink {
 public:
  Sink() = default;
  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// Throws ClosedPipe, or std::runtime_error with the reason.
  virtual void append(std::string_view bytes) = 0;
  /// The output is complete. Throws as `append` does.
  virtual void finish() {}
};

/// Writes all bytes to a descriptor, called `name` in errors. Throws as Sink::append.
void write_all(int descriptor, std::string_view bytes, const std::string& name);

/// Standard output, after what std::cout was given. On a terminal control characters are made
/// visible (proto/text.h) and, with `may_page`, text longer than the screen goes through a pager:
/// $OBLIQUE_PAGER, else $PAGER, else `less -FRSX`; none where that is empty or `cat`. `finish` and
/// the destructor wait until the user has left the pager, which gets Ctrl-C meanwhile.
class StandardOutput : public Sink {
 public:
  explicit StandardOutput(bool may_page = false);
  ~StandardOutput() override;

  void append(std::string_view bytes) override;
  void finish() override;
  bool is_paged() const { return pager_ != nullptr; }

 private:
  void start_pager();
  void wait_for_pager();

  bool is_terminal_;
  std::string pager_command_;  // empty: text is written at once
  std::string first_screen_;   // held back until it is known to be longer than the screen
  std::unique_ptr<ChildProcess> pager_;
  Descriptor to_pager_;
};

/// Whether output to that name is written as it comes: to a device, a pipe or /dev/stdout. Throws
/// solver::InputError for a folder and for links that form a circle.
bool is_written_in_place(const std::string& path);

/// A file that appears under its name when it is finished. Until then, and if that never happens,
/// the previous file stays, and nothing is left beside it on file systems that have nameless files
/// (NFS has none). A link stays, and its target is the file. What is no regular file is written in
/// place.
class AtomicFile : public Sink {
 public:
  /// Throws solver::InputError, which says that `flag` named it, when it cannot be created.
  explicit AtomicFile(const std::string& path, std::string_view flag = "--out");
  ~AtomicFile() override;

  void append(std::string_view bytes) override;
  void finish() override;

 private:
  void open_draft();

  std::string name_;  // in errors
  std::string path_;  // behind the links
  bool is_in_place_ = false;
  std::string draft_;      // temporary name beside the file
  bool has_name_ = false;  // the draft has its temporary name
  Descriptor descriptor_;
};

}  // namespace oblique::client
