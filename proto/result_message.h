#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::protocol {

/// Maximum absolute value of a number in a result, in SI units. No real finger reaches it. It is
/// finite in every unit in which results are shown.
inline constexpr double kLargestOutput = 1e100;
/// Maximum number of elements of a list in a result, such as peaks. Real results have some dozens.
inline constexpr int kMaxListElements = 4096;
/// Maximum number of ranges of left-out points in one message.
inline constexpr int kMaxLeftOutRanges = 10'000;
/// Maximum size of a result [bytes].
inline constexpr std::size_t kMaxResultBytes = std::size_t{1} << 20U;

// Results as messages. Their scalars are those of solver::result_fields(), in the same order and
// without names. The worker sends the names once, in WorkerHello.

/// Returns the message for a result, without the inputs of the point.
PointResult to_message(std::uint64_t point, const solver::CaseResult& result);

/// Returns the result in a message. Members that the message lacks are 0 or empty.
solver::CaseResult from_message(const PointResult& message);

/// Returns the message for a failed point. An empty reason becomes "unknown".
PointResult failed_point(std::uint64_t point, const std::string& reason);

/// Returns why a received result is invalid, or an empty text. A result is invalid if it has a
/// wrong number of scalars, lacks a required scalar, has a number that is not finite or exceeds
/// kLargestOutput, has lists of impossible length, or is too large.
std::string fault_of(const PointResult& message);

/// Maximum size of the rows of a trace [bytes]. A frame contains them with a result and a model.
inline constexpr std::size_t kMaxTraceBytes =
    kMaxFrameBytes - kMaxResultBytes - (std::size_t{64} << 10U);

/// Returns why a received trace is invalid, or an empty text. `shape` and `with_fall` are as
/// requested.
std::string fault_of_trace(const Trace& trace, const solver::TraceShape& shape, bool with_fall);

void set_protocol(WorkerHello& hello);

/// Returns the names of the scalars that this build sends and expects, separated by spaces.
std::string sent_outputs();

/// Returns why the server refuses the worker, or an empty text. Reasons are another version of the
/// protocol and other outputs in the worker's results.
std::string hello_error(const WorkerHello& hello);

/// Returns the number of points that are solved, failed or left out by a filter.
inline std::uint64_t completed_points(const StudyStatus& study) {
  return study.solved() + study.failed() + study.left_out();
}

/// Returns the number of points that are not completed. A filter may still leave out some of them.
inline std::uint64_t open_points(const StudyStatus& study) {
  return study.points() - completed_points(study);
}

}  // namespace oblique::protocol
