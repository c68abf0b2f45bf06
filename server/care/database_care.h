#pragma once

#include <string>
#include <vector>

namespace oblique::server {

/// Copies the database at `from` to `to`, as it is at one instant, while a server may be writing to
/// it. The copy appears under its name only when it is whole, checked and on the disk. Throws
/// StorageError naming what was found: no database of ours at `from`, something at `to`, no room, a
/// damaged page.
void back_up(const std::string& from, const std::string& to);

/// What can be said of a database, a sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most some twenty of a kind; empty: it is sound
  std::vector<std::string> remarks;  ///< studies that are not finished, and what cannot be told
};

/// Looks at everything in the database at `path`: every page and index, every reference, that rows
/// are what was stored and of points that their studies have, with the recipe's H, mu, e and model,
/// that no study is called done that is not. Throws StorageError when it is no database of ours.
Diagnosis diagnose(const std::string& path);

/// The faults alone.
std::vector<std::string> find_faults(const std::string& path);

}  // namespace oblique::server
