#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace oblique::server {

/// The outcome of merging one database.
struct Merged {
  std::uint64_t studies_added = 0;
  std::uint64_t studies_united = 0;  ///< number of studies with the same name and a matching recipe
  /// number of united studies that grew, because the source had more points
  std::uint64_t studies_grown = 0;
  std::uint64_t results_added = 0;
  std::uint64_t results_known = 0;      ///< number of points that already had a result and keep it
  std::uint64_t failures_replaced = 0;  ///< number of added results that replaced a failure
  /// number of points that both databases have solved with different outputs
  std::uint64_t results_differing = 0;
  std::vector<std::string> remarks;  ///< sentences, for example about the first differing results
};

/// A source contradicts the target and was not merged. The message has the remedy.
class MergeRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Merges studies and results of other databases into a target. Studies of the same name are united
/// if their recipes are equal or one begins with the other, as after growth. Rows of the target are
/// kept, except that a solved row replaces a failed row. Sources are only read, and a server may
/// use them; no server may use the target.
class Merger {
 public:
  /// Opens or creates the target and locks it against servers. Throws StorageError.
  explicit Merger(const std::string& target) : target_(target), path_(target) {}

  /// Merges the database `source`, in its state at one instant, in one transaction: completely or,
  /// if this throws or the process ends, not at all. Merging a source again adds only new rows.
  /// Needs disk space for a copy of the source beside the target. `source` must not be the target.
  /// `rename_prefix` is prepended to the name of a study if the target has a study of that name
  /// with another recipe; without it such a source is refused. Throws StorageError for files that
  /// cannot be read or written and for damaged rows, and MergeRefused.
  Merged merge(const std::string& source, const std::string& rename_prefix = {});

  /// Moves all changes from the log into the target's file. Returns false if a reader prevents it.
  bool finish() { return target_.merge_log(); }

 private:
  Store target_;  // also holds the lock on the target
  std::string path_;
};

}  // namespace oblique::server
