#pragma once

#include <string>
#include <string_view>

#include "client/io/sink.h"

namespace oblique::client {

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
