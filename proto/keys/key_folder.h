#pragma once

#include <optional>
#include <string>

#include "proto/keys/authorized_keys.h"
#include "proto/keys/curve_key.h"
#include "proto/keys/role.h"

// A folder with the key of a server, the list of those that it admits, and keys for these.
namespace oblique::protocol {

/// Paths in such a folder.
std::string key_file_in(const std::string& folder, const std::string& name);
std::string authorized_keys_in(const std::string& folder);

/// `named` or, where that is empty, this folder or the `keys` in it, whichever has a server's key
/// or list. Throws solver::InputError where it has neither.
std::string key_folder_meant(const std::string& named);

/// Makes server.key, client.key, worker.key, reader.key and the list with the last three, and the
/// folder, mode 0700, where there is none. Gives the server's public key. Throws std::runtime_error
/// when one of them is there already or cannot be made; then what was made is removed.
CurveKey make_key_folder(const std::string& folder);

/// Lists a key of that name: `public_key`, or that of a new pair, which NAME.key gets. Throws
/// solver::InputError when name or key are listed already, or the server's key cannot be read, and
/// std::runtime_error when a file cannot be written or is there; then nothing is listed.
AuthorizedKey add_key(const std::string& folder, const std::string& name, Role role,
                      const std::optional<CurveKey>& public_key);

}  // namespace oblique::protocol
