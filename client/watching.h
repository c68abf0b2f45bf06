#pragma once

#include <functional>
#include <string>

#include "client/progress.h"
#include "client/source.h"
#include "client/stop_signal.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Asks where one study is, over and over, and shows it on standard error, until it no longer runs
/// or `stop` is requested. Asks often at first, then ever less. Throws what `ask` throws.
/// Returns the last status.
protocol::StudyStatus watch_study(const std::function<protocol::StudyStatus()>& ask,
                                  StopSignal& stop);

/// The one study of that name in an answer to a status question.
protocol::StudyStatus the_study(Source& source, const std::string& name);

/// Tells on standard error how a watched study stands: failed points with their reasons, or that
/// it was cancelled. Gives the exit code: kDone when every point is solved.
int tell_end(const protocol::StudyStatus& status,
             const std::function<protocol::QueryReply(const std::string&)>& query);

/// Columns and rows of studies for `status` and `studies`.
protocol::QueryReply table_of(const std::vector<protocol::StudyStatus>& studies);

}  // namespace oblique::client
