#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/scheduler/scheduler_events.h"

namespace oblique::server {

/// Studies and points that may be open at a time. A study is open until it is done or cancelled; a
/// point of it, until it is solved or has failed.
struct StudyBounds {
  std::uint64_t studies = 100'000;
  std::uint64_t points = 10'000'000'000'000;
  std::uint64_t studies_of_key = 10'000;
  std::uint64_t points_of_key = 1'000'000'000'000;
};

/// Counts what is open, by the key whose holder submitted it. What was submitted without a key
/// counts in the sums alone. Not thread-safe.
class OpenStudies {
 public:
  explicit OpenStudies(const StudyBounds& bounds) : bounds_(bounds) {}

  /// What one key has.
  struct Share {
    std::uint64_t studies = 0;
    std::uint64_t points = 0;
    std::uint64_t refused = 0;  ///< requests, since the server began
  };

  /// The study, submitted with that key, has so many open points. An empty key: with none.
  void set(StudyId study, const std::string& key, std::uint64_t points);
  /// The same for a study that is open; else nothing.
  void set_points(StudyId study, std::uint64_t points);
  /// It is not open.
  void close(StudyId study);

  /// Why the holder of `key` cannot have that study open with so many points, which names the
  /// bound; or an empty text. One that is open already gets further points at most.
  std::string objection_to(StudyId study, const std::string& key, std::uint64_t points) const;
  void count_refusal(const std::string& key) { ++shares_[key].refused; }

  /// Keys that have something open or were refused something; "": what has none.
  const std::map<std::string, Share>& shares() const { return shares_; }

 private:
  struct Study {
    std::map<std::string, Share>::iterator share;
    std::uint64_t points;
  };

  StudyBounds bounds_;
  std::map<StudyId, Study> studies_;
  std::map<std::string, Share> shares_;
  std::uint64_t points_ = 0;  // of all
};

}  // namespace oblique::server
