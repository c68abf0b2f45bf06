#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/store/changes.h"

namespace oblique::server {

/// A reply that waits until results are reused, or long enough.
struct HeldReply {
  std::uint64_t study_id;
  std::string client;
  protocol::ClientReply reply;
  std::int64_t until_ms = 0;
};

/// Which studies have results, what studies took over from others, how far the lookup of each is,
/// and whose replies wait for its end. Not thread-safe.
class TakeOvers {
 public:
  /// A lookup ends early after so many probes, or so long, without a result.
  static constexpr std::uint64_t kMostProbesInVain = 1'000'000;
  static constexpr std::int64_t kLongestInVain_ms = 1500;

  /// `solver_version` is that of the results that are reused; empty: none are.
  explicit TakeOvers(std::string solver_version) : solver_version_(std::move(solver_version)) {}

  const std::string& solver_version() const { return solver_version_; }

  /// The study has results.
  void note_source(std::uint64_t study_id) { sources_.insert(study_id); }
  /// Whether another study has results, and a study of that solver version, or of none
  /// yet, can have them.
  bool should_seek(std::uint64_t study_id, std::string_view version) const;

  /// Adds points by the name that their source had when they were copied, as the database has them.
  void restore(std::uint64_t study_id, const std::map<std::string, std::uint64_t>& from);

  /// A lookup begins. False when one is under way, which begins again at its end.
  bool begin(std::uint64_t study_id, std::int64_t now_ms);
  /// A part is durable. Returns where the next one begins; nothing: the lookup is over.
  std::optional<std::uint64_t> add_part(std::uint64_t study_id, const ReusedResults& part,
                                        std::int64_t now_ms);
  /// The lookup ends although other results may be known.
  void cut_short(std::uint64_t study_id);
  /// The part under way is the last one.
  void stop(std::uint64_t study_id);
  /// The end of the lookup is durable. True when it begins again.
  bool end(std::uint64_t study_id, std::int64_t now_ms);
  /// The study is deleted.
  void forget(std::uint64_t study_id);

  bool is_under_way(std::uint64_t study_id) const;
  /// For people and programs; without fields when there is nothing to say.
  protocol::TakenOver message_of(std::uint64_t study_id) const;

  void hold(HeldReply reply) { held_.push_back(std::move(reply)); }
  /// The replies of studies of which no lookup is under way, and those that waited long enough; of
  /// that study all.
  std::vector<HeldReply> release(std::int64_t now_ms, std::uint64_t study_id = 0);

 private:
  struct Lookup {
    std::int64_t last_result_ms;
    std::uint64_t probes_in_vain = 0;
    bool begins_again = false;  // the study grew
    bool is_stopped = false;
  };
  struct Taken {
    std::map<std::string, std::uint64_t> from;
    std::uint64_t points = 0;
    bool cut_short = false;
    std::optional<Lookup> lookup;
  };

  std::string solver_version_;
  std::set<std::uint64_t> sources_;
  std::map<std::uint64_t, Taken> taken_;
  std::vector<HeldReply> held_;
};

}  // namespace oblique::server
