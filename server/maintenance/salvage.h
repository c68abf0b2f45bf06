#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// Counts of what could be read of a damaged database.
struct Salvaged {
  std::uint64_t studies = 0;
  std::uint64_t results = 0;
  std::uint64_t unreadable_places = 0;  ///< number of gaps: damaged pages or bad values
};

/// Makes a sound database `to` from the readable rows of `from`. After an unreadable place at most
/// as many readable rows are skipped as were lost. Points whose rows are lost are open, and a
/// server solves them again. `from` is not changed; no server may use it. Throws StorageError when
/// `to` exists or `from` cannot be opened, std::runtime_error when `to` cannot be written.
Salvaged salvage(const std::string& from, const std::string& to);

}  // namespace oblique::server
