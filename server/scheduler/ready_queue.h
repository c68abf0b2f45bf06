#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>

namespace oblique::server {

/// The workers with credit, first come first served. A worker for which there was nothing is
/// parked: it keeps its place and is skipped until something changes for it, so that an event costs
/// what it changes, however many workers wait.
class ReadyQueue {
 public:
  using WorkerId = std::uint64_t;

  /// At the end, unless it is in the queue already.
  void add(WorkerId worker) {
    if (places_.emplace(worker, last_place_ + 1).second) {
      active_.emplace(++last_place_, worker);
    }
  }
  void remove(WorkerId worker) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      active_.erase(found->second);
      parked_.erase(found->second);
      places_.erase(found);
    }
  }
  void park(WorkerId worker) { move(worker, active_, parked_); }
  void unpark(WorkerId worker) { move(worker, parked_, active_); }
  void unpark_all() { active_.merge(parked_); }
  /// Moves the first worker to the end.
  void rotate() {
    if (!places_.empty()) {
      const bool is_active =
          parked_.empty() || (!active_.empty() && active_.begin()->first < parked_.begin()->first);
      const WorkerId first = (is_active ? active_ : parked_).begin()->second;
      remove(first);
      add(first);
    }
  }

  bool contains(WorkerId worker) const { return places_.contains(worker); }
  std::size_t size() const { return places_.size(); }
  bool has_active() const { return !active_.empty(); }
  WorkerId first_active() const { return active_.begin()->second; }

 private:
  using ByPlace = std::map<std::uint64_t, WorkerId>;

  void move(WorkerId worker, ByPlace& from, ByPlace& to) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      to.insert(from.extract(found->second));
    }
  }

  std::unordered_map<WorkerId, std::uint64_t> places_;
  ByPlace active_;
  ByPlace parked_;
  std::uint64_t last_place_ = 0;
};

}  // namespace oblique::server
