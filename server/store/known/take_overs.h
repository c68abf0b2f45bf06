#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// A reply that waits until points are taken over, or long enough.
struct HeldReply {
  std::uint64_t study_id;
  std::string client;
  protocol::ClientReply reply;
  std::int64_t until_ms = 0;
};

/// What studies took over from others, which of them still do, and who waits for that. Not
/// thread-safe.
class TakeOvers {
 public:
  /// `solver_version` is that of the results that are taken; empty: none are.
  explicit TakeOvers(std::string solver_version) : solver_version_(std::move(solver_version)) {}

  const std::string& solver_version() const { return solver_version_; }

  /// The study has results; true when that is new.
  bool note_source(std::uint64_t study_id) { return sources_.insert(study_id).second; }
  bool is_source(std::uint64_t study_id) const { return sources_.contains(study_id); }
  /// Whether points should be sought for a study whose results are of that version, or of any.
  bool should_seek(std::uint64_t study_id, std::string_view version, bool mixes_versions) const;

  /// From the database: points by the study that they came from.
  void restore(std::uint64_t study_id, const std::map<std::string, std::uint64_t>& from);
  /// Points are sought; as often as it is said they must end.
  void begin(std::uint64_t study_id) { ++taken_[study_id].under_way; }
  void add(std::uint64_t study_id, const std::string& origin, std::uint64_t points);
  /// An origin is called otherwise from now on.
  void rename_origin(const std::string& before, const std::string& name);
  /// `is_cut_short`: not all that may be known was found. True when nothing is sought any more.
  bool end(std::uint64_t study_id, bool is_cut_short);
  /// It is deleted.
  void forget(std::uint64_t study_id);

  bool is_under_way(std::uint64_t study_id) const;
  /// For people and programs; without fields when there is nothing to say.
  protocol::TakenOver message_of(std::uint64_t study_id) const;

  void hold(HeldReply reply) { held_.push_back(std::move(reply)); }
  /// The replies of studies of which nothing is sought any more, and those that waited long enough;
  /// of that study all.
  std::vector<HeldReply> release(std::int64_t now_ms, std::uint64_t study_id = 0);

 private:
  struct Taken {
    std::map<std::string, std::uint64_t> from;
    std::uint64_t points = 0;
    std::uint32_t under_way = 0;
    bool cut_short = false;
  };

  std::string solver_version_;
  std::set<std::uint64_t> sources_;
  std::map<std::uint64_t, Taken> taken_;
  std::vector<HeldReply> held_;
};

}  // namespace oblique::server
