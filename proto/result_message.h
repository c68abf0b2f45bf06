#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::protocol {

/// Largest magnitude of a number in a result, in SI units. Far beyond anything that happens to a
/// finger, and small enough that it stays finite in every unit in which it is shown.
inline constexpr double kLargestOutput = 1e100;
/// Most elements of a list in a result, as peaks. Honest ones have dozens.
inline constexpr int kMaxListElements = 4096;
/// Most ranges of points that a filter leaves out, in one message.
inline constexpr int kMaxLeftOutRanges = 10'000;
/// Most bytes of a result.
inline constexpr std::size_t kMaxResultBytes = std::size_t{1} << 20U;

// What a worker sends of a solved point. The scalars are those of solver::result_fields(), in its
// order and without their names, which the worker says once, when it joins.

/// What solving a point gave, without its inputs.
PointResult to_message(std::uint64_t point, const solver::CaseResult& result);

/// The result that was made a message; what it does not hold is 0 or empty.
solver::CaseResult from_message(const PointResult& message);

/// A failed point. An empty reason becomes "unknown".
PointResult failed_point(std::uint64_t point, const std::string& reason);

/// Why a result from the network is none, or an empty text: another number of scalars than results
/// have, or none where no result may lack one, a number that is not finite or beyond
/// kLargestOutput, lists of impossible length, more elements, bytes or longer texts than results
/// have.
std::string fault_of(const PointResult& message);

/// Most bytes of the rows of a trace: with its result and the model it fits into one frame.
inline constexpr std::size_t kMaxTraceBytes =
    kMaxFrameBytes - kMaxResultBytes - (std::size_t{64} << 10U);

/// What is wrong with a trace of that shape from the network, or an empty text: rows of the wrong
/// length, values that are not finite, unknown states, rows of the fall unasked or after the touch,
/// or its result.
std::string fault_of_trace(const Trace& trace, const solver::TraceShape& shape, bool with_fall);

/// Sets the protocol version and the outputs of this build.
void set_protocol(WorkerHello& hello);

/// The names of the scalars that results have, in their order, with spaces between.
std::string sent_outputs();

/// Why the server does not take results of that worker, or an empty text: it speaks another version
/// of the protocol, or its results have other outputs, so that numbers would mean something else.
std::string hello_error(const WorkerHello& hello);

/// Points of a study that are solved, failed or left out by a filter.
inline std::uint64_t completed_points(const StudyStatus& study) {
  return study.solved() + study.failed() + study.left_out();
}

/// The others. The filter may still leave out some of them.
inline std::uint64_t open_points(const StudyStatus& study) {
  return study.points() - completed_points(study);
}

}  // namespace oblique::protocol
