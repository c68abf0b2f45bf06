#pragma once

#include <string>

#include "proto/keys/key_file.h"

namespace oblique::client {

/// Keys that nobody else has, for as long as this object lives, in a folder for their owner alone
/// below TMPDIR.
class KeysForARun {
 public:
  /// Throws std::runtime_error when they cannot be written.
  KeysForARun();
  ~KeysForARun();
  KeysForARun(const KeysForARun&) = delete;
  KeysForARun& operator=(const KeysForARun&) = delete;

  /// The key file of that role's program.
  std::string file_of(protocol::Role role) const;

 private:
  std::string folder_;
};

}  // namespace oblique::client
