#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace oblique::server {

struct MergeSettings {
  /// Goes before the name of a study whose name is taken by one with other points, another model or
  /// another choice of errors; empty: such a database is refused.
  std::string rename_prefix;
};

/// What the merge of one database changed.
struct Merged {
  std::uint64_t studies_added = 0;
  std::uint64_t studies_united = 0;  ///< with one of the same name and recipe, or of its beginning
  std::uint64_t studies_grown = 0;   ///< of these: the source had more points
  std::uint64_t results_added = 0;
  std::uint64_t results_known = 0;      ///< points that had a result already, which stays
  std::uint64_t failures_replaced = 0;  ///< of those added: points that had failed in the target
  std::uint64_t results_differing = 0;  ///< of those known: solved in both, with other numbers
  std::vector<std::string> remarks;  ///< sentences for people: the first results that differ, ...
};

/// A database was not merged, and nothing of it was: its studies contradict those of the target.
/// The message gives the remedy.
class MergeRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Brings studies and results of other databases into one. Studies of the same name are united when
/// their recipes are equal or one is the beginning of the other, as after growth. A row of the
/// target stays, but that of a failed point is replaced by a solved one. Sources are only read, and
/// a server may be at work on them, but not on the target.
class Merger {
 public:
  /// Opens the target, or makes it, and locks it against servers. Throws StorageError.
  explicit Merger(const std::string& target) : target_(target), path_(target) {}

  /// Called now and then with the number of rows merged so far.
  using Progress = std::function<void(std::uint64_t merged, std::uint64_t rows)>;

  /// Merges the database at `source` as it is at one instant, in one transaction: all of it or,
  /// when this throws or the process ends, nothing. What was merged before changes nothing. Needs
  /// room for a copy of the source beside the target. Throws StorageError for what cannot be read
  /// or written and for damaged rows, and MergeRefused. `source` must not be the target.
  Merged merge(const std::string& source, const MergeSettings& settings, const Progress& progress);

  /// Moves all changes into the one file of the target. False when a reader prevents it.
  bool finish() { return target_.merge_log(); }

 private:
  Store target_;  // has the schema and the lock
  std::string path_;
};

}  // namespace oblique::server
