#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace oblique::server {

/// What the merge of one database changed.
struct Merged {
  std::uint64_t studies_added = 0;
  std::uint64_t studies_united = 0;  ///< with one of the same name and a matching recipe
  std::uint64_t studies_grown = 0;   ///< of these: the source had more points
  std::uint64_t results_added = 0;
  std::uint64_t results_known = 0;      ///< points that already had a result, which stays
  std::uint64_t failures_replaced = 0;  ///< of the added ones: the point had failed in the target
  std::uint64_t results_differing = 0;  ///< of the known ones: solved in both, other outputs
  std::vector<std::string> remarks;     ///< sentences, such as about the first results that differ
};

/// A source contradicts the target, so nothing of it was merged. The message gives the remedy.
class MergeRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Brings studies and results of other databases into one. Studies of the same name are united when
/// their recipes are equal or one is the beginning of the other, as after growth. A row of the
/// target stays, except that a solved row replaces a failed one. Sources are only read; a server
/// may use them, but not the target.
class Merger {
 public:
  /// Opens the target, or makes it, and locks it against servers. Throws StorageError.
  explicit Merger(const std::string& target) : target_(target), path_(target) {}

  /// Merges the state of the database `source` at one instant, in one transaction: everything or,
  /// if this throws or the process ends, nothing. A source that was merged before adds only new
  /// rows. Needs room for a copy of the source beside the target. Throws StorageError for files
  /// that cannot be read or written and for damaged rows, and MergeRefused. `source` must not be
  /// the target. `rename_prefix` goes before the name of a study if the target has a study of that
  /// name with another recipe; empty: such a source is refused.
  Merged merge(const std::string& source, const std::string& rename_prefix = {});

  /// Moves all changes into the one file of the target. False when a reader prevents it.
  bool finish() { return target_.merge_log(); }

 private:
  Store target_;  // has the schema and the lock
  std::string path_;
};

}  // namespace oblique::server
