#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/database/database_file.h"

namespace oblique::server {

/// Copies the database at `from` to `to`, in its state at one instant, while a server may write to
/// it. The copy gets its name only when it is complete, checked and synced. Returns the faults of
/// its contents (`diagnose_contents`), which are those of `from`. Throws StorageError, with the
/// reason, if `from` is no database of ours, `to` exists, the disk is full, or a page or the schema
/// is damaged.
std::vector<std::string> back_up(const std::string& from, const std::string& to);

/// Copies like `back_up`, but into a draft. `to` is the name of the copy in error messages.
std::vector<std::string> copy_into(const DraftFile& draft, const std::string& from,
                                   const std::string& to);

/// Numbers of readable rows in a damaged database.
struct Salvaged {
  std::uint64_t studies = 0;
  std::uint64_t results = 0;
  std::uint64_t unreadable_places = 0;  ///< number of gaps: damaged pages or invalid values
  /// a sentence about everything that is not as it was stored, except lost results
  std::set<std::string> losses;
};

/// Makes a sound database `to` from the readable rows of `from`. A gap of n unreadable rows costs
/// at most n readable rows. A server that opens `to` solves the points of lost rows again. A study
/// whose recipe, models or workers do not match their checksums gets another name and is paused.
/// Does not change `from`. Needs disk space for another copy. No server may use `from` meanwhile.
/// Throws StorageError if `to` exists or `from` cannot be opened, and std::runtime_error if `to`
/// cannot be written.
Salvaged salvage(const std::string& from, const std::string& to);

}  // namespace oblique::server
