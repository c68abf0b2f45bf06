#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace oblique::simulation {

/// What a store gives to a server that starts.
struct Found {
  std::vector<server::StoredStudy> studies;
  std::uint64_t last_study_id = 0;
  std::uint64_t last_worker_id = 0;
  std::uint64_t starts = 0;  ///< of servers, this one included
};

/// What a store must hold after the changes that it was given, kept in the plainest way. The real
/// store is held against it. Throws Violation where they differ.
class StoreModel {
 public:
  using Rows = std::map<std::uint64_t, std::shared_ptr<const protocol::PointResult>>;

  /// The store took these changes. None may be a result for a point that has one.
  void stored(std::span<const server::Change> changes);
  /// The store refused them: they are not there, but as long as nothing was written in their place
  /// a crash may bring them back, all or none.
  void refused(std::span<const server::Change> changes);

  /// A commit with a full sync of something that is not held against this model.
  void synced();

  /// What a store holds after a restart must be all that was stored, or, when power was lost, that
  /// without the last commits since the one that was synced. Takes it for the truth.
  void restarted(const Found& found, bool power_was_lost);

  /// The study called `name`, or nullptr.
  const server::StoredStudy* study(const std::string& name) const;
  const server::StoredStudy* study(std::uint64_t study_id) const;
  const Rows& rows(std::uint64_t study_id) const;

  std::uint64_t failed_commits = 0;
  std::uint64_t undone_commits = 0;  ///< that losing power undid
  std::uint64_t refused_kept = 0;    ///< that failed and were there after a crash

 private:
  struct Contents {
    std::map<std::uint64_t, server::StoredStudy> studies;
    std::map<std::uint64_t, Rows> rows;
    std::uint64_t last_study_id = 0;  ///< of deleted ones too
    std::uint64_t last_worker_id = 0;
    bool has_deleted = false;  ///< then rows of workers may be gone, the last one's too

    bool operator==(const Found& found) const;
  };
  struct Entry {
    std::vector<server::Change> changes;
    bool stored;
  };
  /// Says whether anything had to be written.
  static bool apply(const server::Change& change, Contents& contents);
  static bool apply(const server::AddResults& change, server::StoredStudy& study, Rows& rows);
  static bool apply(const server::ForgetFailures& change, server::StoredStudy& study, Rows& rows);
  static void apply_all(const Entry& entry, Contents& contents);

  Contents now_;
  Contents synced_;             // at the last commit with a full sync
  std::vector<Entry> entries_;  // what came since, in order
};

}  // namespace oblique::simulation
