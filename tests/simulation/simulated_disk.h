#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store.h"

namespace oblique::simulation {

/// What is found on a disk when the server starts.
struct Found {
  std::vector<server::StoredStudy> studies;
  std::uint64_t last_study_id;
  std::uint64_t last_worker_id;
};

/// A disk that keeps what was committed, in memory. It can be full, and losing power makes it
/// forget commits that were not synced.
class SimulatedDisk final : public server::Storage {
 public:
  /// Throws Violation when a result is written for a point that has one.
  void commit(std::span<const server::Change> changes) override;

  Found load() const;
  /// Forgets the last commits, as many as `at_most` and none that was synced.
  void lose_power(std::uint64_t at_most);

  bool has_result(std::uint64_t study_id, std::uint64_t point) const;
  /// The study called `name`, or nullptr.
  const server::StoredStudy* study(const std::string& name) const;
  const std::map<std::uint64_t, protocol::PointResult>& results(std::uint64_t study_id) const;

  bool full = false;

 private:
  struct Contents {
    std::map<std::uint64_t, server::StoredStudy> studies;
    std::map<std::uint64_t, std::map<std::uint64_t, protocol::PointResult>> results;
    std::uint64_t last_worker_id = 0;
  };
  void apply(const server::Change& change);

  Contents contents_;
  /// What each commit since the last synced one added, newest last.
  std::vector<std::vector<std::pair<std::uint64_t, std::uint64_t>>> unsynced_;
};

}  // namespace oblique::simulation
