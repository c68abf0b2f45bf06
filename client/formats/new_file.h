#pragma once

#include <string>
#include <string_view>

#include "client/formats/sink.h"

namespace oblique::client {

/// Where bytes for the name `path` go, which may be a link.
struct FilePlace {
  std::string path;            ///< behind the links, as far as they lead to names
  bool is_in_place = false;    ///< written as it is: a device, a named pipe, /dev/stdout
  int open_descriptor = -1;    ///< in place: what this process has open there already; or -1
  std::string folder() const;  ///< of `path`
};
/// Throws solver::InputError, in which `flag` named it, for a folder and for links that lead round
/// in a circle.
FilePlace file_place(const std::string& path, std::string_view flag = "--out");

/// A file that appears under its name, whole, when it is finished. Before that, and if that never
/// happens, what was there under the name stays, and nothing is left beside it: what is written has
/// no name where the file system can do so (most do, NFS does not). A link stays, and what it leads
/// to is the file. What is no regular file is opened and written as it is.
class NewFile : public Sink {
 public:
  /// Throws solver::InputError, in which `flag` named it, when it cannot be made.
  explicit NewFile(const std::string& path, std::string_view flag = "--out");
  ~NewFile() override;

  void finish() override;

 protected:
  void write(std::string_view bytes) override;

 private:
  void open_draft();

  std::string name_;  // as errors say it
  FilePlace place_;
  std::string draft_;  // the name beside the file's that it has before it appears
  bool has_name_ = false;
  int descriptor_ = -1;
};

}  // namespace oblique::client
