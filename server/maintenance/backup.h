#pragma once

#include <cstdint>
#include <string>

#include "server/database/database_file.h"

namespace oblique::server {

/// Copies the database at `from` to `to`, as it is at one instant, while a server may be writing to
/// it. The copy appears under its name only when it is complete, checked and on the disk. Throws
/// StorageError, which names the reason: `from` is no database of ours, `to` exists, no room, a
/// damaged page.
void back_up(const std::string& from, const std::string& to);

/// Copies the database at `from` into a draft, as one checked file without a log. Throws as
/// `back_up` does; `to` is the name of the copy in error messages.
void copy_into(const DraftFile& draft, const std::string& from, const std::string& to);

/// Counts of what could be read of a damaged database.
struct Salvaged {
  std::uint64_t studies = 0;
  std::uint64_t results = 0;
  std::uint64_t unreadable_places = 0;  ///< number of gaps: damaged pages or bad values
};

/// Makes a sound database `to` from the readable rows of `from`. After an unreadable place at most
/// as many readable rows are skipped as were lost. Points without a row are open, and a server
/// solves them again. `from` is not changed; no server may use it. Throws StorageError when `to`
/// exists or `from` cannot be opened, std::runtime_error when `to` cannot be written.
Salvaged salvage(const std::string& from, const std::string& to);

}  // namespace oblique::server
