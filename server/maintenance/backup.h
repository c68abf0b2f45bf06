#pragma once

#include <string>

#include "server/database/draft_file.h"

namespace oblique::server {

/// Copies the database at `from` to `to`, as it is at one instant, while a server may be writing to
/// it. The copy appears under its name only when it is complete, checked and on the disk. Throws
/// StorageError, which names the reason: `from` is no database of ours, `to` exists, no room, a
/// damaged page.
void back_up(const std::string& from, const std::string& to);

/// Copies the database at `from` into a draft, as one checked file without a log. Returns a remark
/// if `from` was read in an unusual way (open_for_reading), else an empty text. Throws as `back_up`
/// does; `to` is the name of the copy in error messages.
std::string copy_into(const DraftFile& draft, const std::string& from, const std::string& to);

}  // namespace oblique::server
