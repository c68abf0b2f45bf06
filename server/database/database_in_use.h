#pragma once

#include <string>

namespace oblique::server {

/// Locks an open database file for a server until the file is closed. False: another server has it.
bool lock_for_server(int file);

/// Whether a server has the database at `path` open; false for a file that cannot be opened. Takes
/// no lock.
bool is_in_use(const std::string& path);

}  // namespace oblique::server
