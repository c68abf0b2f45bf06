#pragma once

#include <string>

namespace oblique::server {

/// Copies the database at `from` to `to`, as it is at one instant, while a server may be writing to
/// it. The copy appears under its name only when it is whole, checked and on the disk. Throws
/// StorageError naming what was found: no database of ours at `from`, something at `to`, no room, a
/// damaged page.
void back_up(const std::string& from, const std::string& to);

}  // namespace oblique::server
