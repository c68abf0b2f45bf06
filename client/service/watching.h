#pragma once

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

/// Where a watched study is. Given a `tell`, it may take for as long as the server is away.
using AskStatus = std::function<protocol::StudyStatus(const Tell& tell)>;

/// Asks where one study is, over and over, and shows it on standard error, with what it waits for,
/// until it no longer runs or `stop` is requested. Asks often at first, then ever less. Throws what
/// `ask` throws. Returns the last status.
protocol::StudyStatus watch_study(Console& console, const AskStatus& ask,
                                  protocol::StopSignals& stop);

/// The one study of that name in an answer to a status question; std::runtime_error where there is
/// none. Given a `tell`, waits for a server that is away.
protocol::StudyStatus study_named(Source& source, const std::string& name, const Tell& tell = {});
protocol::StudyStatus study_named(Connection& connection, const std::string& name);

/// Asks for one study again and again: by name first, then by its number, so that it is found under
/// another name too. Throws as `study_named`.
class WatchedStudy {
 public:
  WatchedStudy(Source& source, std::string name) : source_(source), name_(std::move(name)) {}
  protocol::StudyStatus ask(const Tell& tell);

 private:
  Source& source_;
  std::string name_;
  std::uint64_t study_id_ = 0;  // 0: it was not found yet
};

/// Tells on standard error how a watched study stands: failed points with their reasons, or that
/// it was cancelled. Gives the exit code: kDone when every point is solved.
int tell_end(Console& console, const protocol::StudyStatus& status,
             const std::function<protocol::Table(const std::string&)>& query);

/// Tells on standard error when anybody may come to the server at `place`, as StatusReply.access
/// says.
void tell_if_insecure(Console& console, const std::string& access, const std::string& place);

/// "12 points are taken over: 7 of a, 5 of b", or an empty text when none are.
std::string taken_over(const protocol::TakenOver& taken);

/// Columns and rows of studies for `status` and `studies`.
protocol::Table table_of(const std::vector<protocol::StudyStatus>& studies);

}  // namespace oblique::client
