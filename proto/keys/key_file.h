#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "proto/keys/curve_key.h"
#include "proto/keys/role.h"

namespace oblique::protocol {

/// What the key file of a program holds.
struct KeyFile {
  Role role = Role::kClient;
  std::string name;  ///< of the key, for people
  KeyPair pair;
  std::optional<CurveKey> server = {};  ///< the server's public key; every role but the server's
  std::string path = {};                ///< of the file that it was read from
};

/// Reads a key file (TOML, README.md). Throws solver::InputError, with file, line and key, unless
/// it is whole and belongs to its owner alone: as ssh does, a file of ours that the group may read
/// is refused, and one that others may read whoever owns it, with the chmod that mends it.
KeyFile read_key_file(const std::string& path);

/// Writes a new file of mode 0600 and flushes it to the disk. Throws std::runtime_error, also when
/// there is one of that name, which is never overwritten.
void write_key_file(const std::string& path, const KeyFile& key);

/// Why a key cannot be called so, or an empty text: 1 to 64 letters, digits, '.', '_', '-' or '@',
/// the first a letter or digit, so that a file can have the name too.
std::string objection_to_key_name(std::string_view name);

}  // namespace oblique::protocol
