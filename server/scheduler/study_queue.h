#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace oblique::server {

/// The studies that have something to hand out, in the order in which they get batches: the highest
/// priority first, then the one served least, then the oldest. Studies that are
/// done, cancelled or paused, or whose points are all leased, are not in it and cost nothing.
class StudyQueue {
 public:
  using StudyId = std::uint64_t;

  /// What a study has to hand out, and what it comes after.
  struct Place {
    bool has_free = false;     ///< points that any worker may get
    bool has_suspect = false;  ///< points that are leased alone
    std::int32_t priority = 0;
    double served = 0.0;           ///< batches handed out
    std::string solver_version{};  ///< of the workers that it is for; empty: of all

    bool operator==(const Place&) const = default;
  };

  /// The study is at this place from now on; with nothing to hand out, nowhere.
  void put(StudyId study, const Place& place);

  bool empty() const { return places_.empty(); }
  /// The study whose free points a worker with this solver gets next; 0: none.
  StudyId next_free(const std::string& solver_version) const;
  /// The least `served` of the studies with free points, without the one named.
  std::optional<double> least_served(StudyId but) const;
  /// The studies with suspect points, the oldest first.
  const std::set<StudyId>& with_suspects() const { return suspects_; }
  /// Where the study is; nowhere: null.
  const Place* find(StudyId study) const;
  std::size_t size() const { return places_.size(); }

 private:
  using Rank = std::tuple<std::int64_t, double, StudyId>;  // minus the priority, served, number
  static Rank rank_of(StudyId study, const Place& place) {
    return {-std::int64_t{place.priority}, place.served, study};
  }
  void take_out(StudyId study, const Place& place);

  std::map<StudyId, Place> places_;
  std::map<std::string, std::set<Rank>, std::less<>> free_;  // by solver version
  std::set<std::pair<double, StudyId>> by_served_;           // those with free points
  std::set<StudyId> suspects_;
};

}  // namespace oblique::server
