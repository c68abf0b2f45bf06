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

/// Finds the sentences that a watched study needs beside its progress: what it waits for, and that
/// it goes on. The clock is the caller's.
class WaitMessages {
 public:
  using Seconds = std::chrono::duration<double>;

  /// A shorter wait is not worth a sentence: workers come and go.
  static constexpr Seconds kShortestWait{2};

  /// The sentence that is due at `elapsed`, which must not fall; or an empty text.
  std::string update(const protocol::StudyStatus& status, Seconds elapsed);

 private:
  std::string reason_;  ///< what the study waits for; empty: for nothing
  Seconds since_{0};
  std::string said_;  ///< the reason that the last sentence named
};

/// The status of a watched study. Given a `tell`, it may take as long as the server is away.
using AskStatus = std::function<protocol::StudyStatus(const Tell& tell)>;

/// Shows the status of a study on standard error, with what it waits for, until it no longer runs
/// or `stop` is requested. Throws what `ask` throws. Returns the last status.
protocol::StudyStatus watch_study(Console& console, const AskStatus& ask,
                                  protocol::StopSignals& stop);

/// The study of that name. Throws std::runtime_error where there is none. Given a `tell`, waits for
/// a server that is away.
protocol::StudyStatus study_named(Source& source, const std::string& name, const Tell& tell = {});

/// The status of one study again and again: found by its name first, then by its number, so that
/// it may be renamed.
class FollowedStudy {
 public:
  FollowedStudy(Source& source, std::string name) : source_(source), name_(std::move(name)) {}
  /// Throws as `study_named` and Source::status_of. Reports a new name to `tell`.
  protocol::StudyStatus status(const Tell& tell);

 private:
  Source& source_;
  std::string name_;
  std::uint64_t study_id_ = 0;  ///< 0: not found yet
};

/// Prints failed points with their reasons, or that the study was cancelled, to standard error.
/// Returns the exit code: kDone when every point is solved.
int print_end(Console& console, const protocol::StudyStatus& status,
              const std::function<protocol::Table(const std::string&)>& query);

/// Warns on standard error when the server at `place` is insecure, as StatusReply.access says.
void warn_if_insecure(Console& console, const std::string& access, const std::string& place);

/// "12 points are taken over: 7 of a, 5 of b", or an empty text.
std::string taken_over(const protocol::ReusedPoints& taken);

/// Columns and rows of studies for `status` and `studies`.
protocol::Table table_of(const std::vector<protocol::StudyStatus>& studies);

}  // namespace oblique::client
