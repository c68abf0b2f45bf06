#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/io/console.h"
#include "client/service/source.h"
#include "proto/oblique.pb.h"
#include "proto/program/process.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Messages about a watched study, shown beside its progress: what the study waits for, and that it
/// continues. The caller supplies the time.
class WaitMessages {
 public:
  using Seconds = std::chrono::duration<double>;

  /// Shortest wait of a study that is reported. Shorter waits are normal: workers come and go.
  static constexpr Seconds kShortestWait{2};

  /// Returns the message that is due at `elapsed`, which must not decrease, or an empty text.
  std::string update(const protocol::StudyStatus& status, Seconds elapsed);

 private:
  std::string reason_;  ///< reason for waiting; empty: the study does not wait
  Seconds since_{0};
  std::string said_;  ///< last reason that was reported
};

/// Returns the status of a watched study. With a `tell`, waits for an unreachable server.
using AskStatus = std::function<protocol::StudyStatus(const Tell& tell)>;

/// Shows the status of a study on standard error until it no longer runs or `stop` is requested.
/// Returns the last status. Throws the errors of `ask`.
protocol::StudyStatus watch_study(Console& console, const AskStatus& ask,
                                  protocol::StopSignals& stop);

/// Returns a Tell that also writes with --quiet, because a server may be away for ever.
Tell tell_errors(Console& console);

/// Returns the status of the study called `name`. Throws std::runtime_error if it does not exist.
/// With a `tell`, waits for an unreachable server.
protocol::StudyStatus study_named(Source& source, const std::string& name, const Tell& tell = {});

/// Requests the status of one study repeatedly: first by its name, then by its number, so that
/// renaming the study does not matter.
class FollowedStudy {
 public:
  FollowedStudy(Source& source, std::string name) : source_(source), name_(std::move(name)) {}
  /// Reports a new name of the study to `tell`. Throws as `study_named` and Source::status_of do.
  protocol::StudyStatus status(const Tell& tell);

 private:
  Source& source_;
  std::string name_;
  std::uint64_t study_id_ = 0;  ///< 0 before the first status
};

/// Prints to standard error the reasons of failures, or that the study was cancelled. Returns the
/// exit code: kDone if every point is solved.
int print_end(Console& console, const protocol::StudyStatus& status,
              const std::function<protocol::Table(const std::string&)>& query);

/// Warns on standard error if the server at `place` is insecure; `access` is StatusReply.access.
void warn_if_insecure(Console& console, const std::string& access, const std::string& place);

/// Returns "12 points reused: 7 from a, 5 from b", or an empty text if no points were reused.
std::string reused_points_note(const protocol::ReusedPoints& taken);

protocol::Table table_of(const std::vector<protocol::StudyStatus>& studies);

}  // namespace oblique::client
