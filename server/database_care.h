#pragma once

#include <string>
#include <vector>

namespace oblique::server {

/// Copies the database at `from` to `to`, as it is at one instant, while a server may be writing to
/// it. The copy appears under its name only when it is whole, checked and on the disk. Throws
/// StorageError naming what was found: no database of ours at `from`, something at `to`, no room, a
/// damaged page.
void back_up(const std::string& from, const std::string& to);

/// What is wrong with the database at `path`, a sentence each, at most some twenty; empty when it
/// is sound: every page and index, every reference, no row of a point that its study does not have,
/// no study called done that is not. Reads all of it. Throws StorageError when it is no database of
/// ours.
std::vector<std::string> find_faults(const std::string& path);

}  // namespace oblique::server
