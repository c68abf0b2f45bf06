#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>

namespace oblique::server {

/// The workers that ask for batches, first come first served. Those for whom there was nothing
/// rest: they keep their places and are not looked at before something has changed for them, so
/// that an event costs what it changes and not what there are workers.
class ReadyLine {
 public:
  using WorkerId = std::uint64_t;

  /// At the end, unless it is in the line already.
  void add(WorkerId worker) {
    if (places_.emplace(worker, last_place_ + 1).second) {
      awake_.emplace(++last_place_, worker);
    }
  }
  void remove(WorkerId worker) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      awake_.erase(found->second);
      resting_.erase(found->second);
      places_.erase(found);
    }
  }
  /// There was nothing for it.
  void rest(WorkerId worker) { move(worker, awake_, resting_); }
  /// Something has changed for it.
  void wake(WorkerId worker) { move(worker, resting_, awake_); }
  /// The same for all.
  void wake_all() { awake_.merge(resting_); }
  /// The first one goes to the end.
  void rotate() {
    if (!places_.empty()) {
      const bool is_awake =
          resting_.empty() || (!awake_.empty() && awake_.begin()->first < resting_.begin()->first);
      const WorkerId first = (is_awake ? awake_ : resting_).begin()->second;
      remove(first);
      add(first);
    }
  }

  bool contains(WorkerId worker) const { return places_.contains(worker); }
  std::size_t size() const { return places_.size(); }
  /// Whether somebody is to be looked at.
  bool has_awake() const { return !awake_.empty(); }
  /// The first of them.
  WorkerId first_awake() const { return awake_.begin()->second; }

 private:
  using Line = std::map<std::uint64_t, WorkerId>;  // by place

  void move(WorkerId worker, Line& from, Line& to) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      to.insert(from.extract(found->second));
    }
  }

  std::unordered_map<WorkerId, std::uint64_t> places_;
  Line awake_;
  Line resting_;
  std::uint64_t last_place_ = 0;
};

}  // namespace oblique::server
