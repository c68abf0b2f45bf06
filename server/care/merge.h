#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace oblique::server {

struct MergeSettings {
  /// Goes before the name of a study whose name is taken by one with other points, another model or
  /// another choice of errors; empty: such a database is refused.
  std::string rename_prefix;
  /// Results of several solver versions may stand in one study.
  bool mixes_versions = false;
};

/// What came of one database.
struct Merged {
  std::uint64_t studies_added = 0;
  std::uint64_t studies_united = 0;  ///< with one of the same name and recipe, or of its beginning
  std::uint64_t studies_grown = 0;   ///< of these: the one that came had more points
  std::uint64_t results_added = 0;
  /// Points that had a result before which a study of another database has too. Theirs stay.
  std::uint64_t results_known = 0;
  std::uint64_t failures_replaced = 0;  ///< points that had failed here and were solved there
  std::uint64_t results_differing =
      0;                             ///< of those known: solved here and there, with other numbers
  std::vector<std::string> remarks;  ///< sentences for people, of the first of these and others
};

/// A database was not merged, and nothing of it was: what it has contradicts what is there. The
/// message says what can be done.
class MergeRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Unites databases: brings studies and results of others into one. A study is the one of the same
/// name and recipe, or of one that is the beginning of the other, as that of a study that grew in
/// one of them; its points are united. A row that is there stays, but that of a failed
/// point gives way to a solved one. Databases that are merged are only read. No server may be at
/// work on the target; on the others it may.
class Merger {
 public:
  /// Opens the target, or makes it, and holds it against servers. Throws StorageError.
  explicit Merger(const std::string& target);
  ~Merger();
  Merger(const Merger&) = delete;
  Merger& operator=(const Merger&) = delete;

  /// Called now and then with how many of the rows were looked at.
  using Progress = std::function<void(std::uint64_t looked_at, std::uint64_t rows)>;

  /// Merges the database at `source` as it is at one instant, in one transaction: all of it, or,
  /// when this throws or the process ends, nothing. What was merged before is passed over. Throws
  /// StorageError for what cannot be read or written, for a row that is not as it was written too,
  /// and MergeRefused. `source` must not be the target.
  Merged merge(const std::string& source, const MergeSettings& settings, const Progress& progress);

  /// Moves all into the one file of the target. False when a reader keeps it from doing so.
  bool finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::server
