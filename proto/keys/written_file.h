#pragma once

#include <string>
#include <string_view>

#include "proto/system/descriptor.h"

namespace oblique::protocol {

/// Writes a file that was not there, mode 0600, to the disk. Throws std::runtime_error, saying that
/// nothing is overwritten where there is one; a file that could not be written whole is removed.
void write_new_file(const std::string& path, std::string_view text);

/// The right to change a file that others change too, by this program, while it lives. What is
/// locked is the file itself, which each change replaces.
class FileTurn {
 public:
  /// Waits until nobody else changes it. A link stays, and what it leads to is the file. Makes the
  /// file, empty and of mode 0600, where there is none. Throws std::runtime_error.
  explicit FileTurn(std::string path);

  /// Replaces the file at once, keeping owner and mode: whoever reads it sees all of the old text
  /// or all of the new one. Throws std::runtime_error, and then nothing has changed.
  void replace(std::string_view text) const;

 private:
  std::string path_;
  Descriptor locked_;
};

}  // namespace oblique::protocol
