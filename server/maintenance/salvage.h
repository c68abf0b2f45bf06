#pragma once

#include <cstdint>
#include <string>

namespace oblique::server {

/// What of a damaged database could be read.
struct Salvaged {
  std::uint64_t studies = 0;
  std::uint64_t results = 0;
  std::uint64_t unreadable_places = 0;  ///< where rows were passed over: damaged pages, bad values
};

/// Makes a sound database `to` of the rows of `from` that can still be read; behind an unreadable
/// place at most as many readable ones are passed over as were lost. Nothing else is lost: points
/// whose rows are gone count as pending, and a server that goes on solves them again. `from` is not
/// changed; no server may be at work on it. Throws StorageError when `to` exists or `from` cannot
/// be opened at all, std::runtime_error when `to` cannot be written.
Salvaged salvage(const std::string& from, const std::string& to);

}  // namespace oblique::server
