#include "proto/result_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/result_fields.h"

namespace oblique::protocol {
namespace {

using solver::CaseResult;
using solver::for_each_sent;
using solver::Member;
using solver::PhaseKind;
using solver::ResultField;
using Numbers = google::protobuf::RepeatedField<double>;
constexpr std::size_t kLongestText = 65536;

/// Returns the value that stands for a missing scalar of type T. No result can have it.
template <class T>
T absent() {
  if constexpr (std::is_same_v<T, double>) {
    return std::numeric_limits<double>::quiet_NaN();
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    return std::numeric_limits<std::int64_t>::min();
  } else {
    return {};
  }
}

template <class T>
bool is_absent(const Member<T>& member, const T& value) {
  // a NaN differs from itself
  return member.may_be_absent && (value == absent<T>() || value != value);
}

template <class T, class Values>
void add_scalars(const CaseResult& result, Values& values) {
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    const T* value = member.of(result);
    *values.Add() = value != nullptr ? *value : absent<T>();
  });
}

/// Reads the scalars of type T. There may be fewer `values` than scalars.
template <class T, class Values>
void read_scalars(const Values& values, CaseResult& result) {
  int i = 0;
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    if (i < values.size() && !is_absent(member, values[i])) {
      member.in(result) = values[i];
    }
    ++i;
  });
}

/// How a list of solver::result_lists() is sent: members of each element, one element after
/// another.
struct SentList {
  const Numbers& (PointResult::*numbers)() const;
  Numbers* (PointResult::*mutable_numbers)();
  std::size_t first_member;
  int members;
  void (*read)(CaseResult& result, const double* element);
};

template <auto list>
void read_pair(CaseResult& result, const double* x) {
  (result.*list).push_back({x[0], x[1]});
}

void read_peak(CaseResult& result, const double* x) {
  result.peaks.push_back({x[0], x[1], x[2], false});
}

/// Appends a phase, which begins where the previous phase ends.
void read_phase(CaseResult& result, const double* end_s) {
  auto& phases = result.phases;
  const auto kind = phases.size() % 2 == 0 ? PhaseKind::kCompression : PhaseKind::kRestitution;
  phases.push_back({kind, phases.empty() ? 0.0 : phases.back().t1_s, *end_s});
}

/// The lists have the same order as in solver::result_lists().
constexpr std::array<SentList, 5> kLists{{
    {&PointResult::peaks, &PointResult::mutable_peaks, 0, 3, read_peak},
    {&PointResult::ft_peaks, &PointResult::mutable_ft_peaks, 0, 2,
     read_pair<&CaseResult::ft_peaks>},
    {&PointResult::phase_ends_s, &PointResult::mutable_phase_ends_s, 2, 1, read_phase},
    {&PointResult::stick_intervals, &PointResult::mutable_stick_intervals, 0, 2,
     read_pair<&CaseResult::stick_intervals>},
    {&PointResult::reaction_peaks, &PointResult::mutable_reaction_peaks, 0, 2,
     read_pair<&CaseResult::reaction_peaks>},
}};

void add_lists(const CaseResult& result, PointResult& message) {
  for (std::size_t i = 0; i < kLists.size(); ++i) {
    Numbers& numbers = *(message.*kLists[i].mutable_numbers)();
    const auto members = static_cast<std::size_t>(kLists[i].members);
    solver::result_lists()[i]->each(result, [&](std::span<const solver::Cell> element) {
      for (const solver::Cell& cell : element.subspan(kLists[i].first_member, members)) {
        numbers.Add(std::get<double>(cell));
      }
    });
  }
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    if (result.peaks[i].major) {
      message.add_major_peaks(static_cast<std::uint32_t>(i));
    }
  }
}

void read_lists(const PointResult& message, CaseResult& result) {
  for (const SentList& list : kLists) {
    const Numbers& numbers = (message.*list.numbers)();
    for (int i = 0; i + list.members <= numbers.size(); i += list.members) {
      list.read(result, numbers.data() + i);
    }
  }
  for (const std::uint32_t number : message.major_peaks()) {
    if (number < result.peaks.size()) {
      result.peaks[number].major = true;
    }
  }
}

std::string fault_of_number(std::string_view name, double number) {
  return std::abs(number) <= kLargestOutput
             ? ""
             : fmt::format(
                   "the worker sent a {} that {}", name,
                   std::isfinite(number) ? "is too large to be stored" : "is not a finite number");
}

std::string fault_of_lists(const PointResult& message) {
  for (std::size_t i = 0; i < kLists.size(); ++i) {
    const std::string_view name = solver::result_lists()[i]->column;
    const Numbers& numbers = (message.*kLists[i].numbers)();
    const int elements = numbers.size() / kLists[i].members;
    if (elements > kMaxListElements) {
      return fmt::format("the worker sent {} {}; at most {} are allowed", elements, name,
                         kMaxListElements);
    }
    if (numbers.size() % kLists[i].members != 0) {
      return fmt::format("the worker sent {} of the wrong length", name);
    }
    for (const double number : numbers) {
      if (std::string fault = fault_of_number(name, number); !fault.empty()) {
        return fault;
      }
    }
  }
  const auto peaks = static_cast<std::uint32_t>(message.peaks_size() / kLists.front().members);
  const bool are_peaks = std::all_of(message.major_peaks().begin(), message.major_peaks().end(),
                                     [&](std::uint32_t number) { return number < peaks; });
  return are_peaks ? "" : "the worker sent the number of a major peak that does not exist";
}

template <class T, class Values>
std::string fault_of_scalars(const Values& values, const char* what) {
  int number = 0;
  std::string fault;
  for_each_sent<T>([&](const ResultField& field, const Member<T>& member) {
    const int i = number++;
    if constexpr (std::is_same_v<T, double>) {
      if (fault.empty() && i < values.size() && !is_absent(member, values[i])) {
        fault = fault_of_number(field.column, values[i]);
      }
    }
  });
  return values.size() == number ? fault
                                 : fmt::format("the worker sent {} {}, and a result has {}",
                                               values.size(), what, number);
}

}  // namespace

PointResult to_message(std::uint64_t point, const CaseResult& result) {
  PointResult message;
  message.set_point(point);
  add_scalars<double>(result, *message.mutable_reals());
  add_scalars<std::int64_t>(result, *message.mutable_whole_numbers());
  add_scalars<std::string>(result, *message.mutable_texts());
  add_lists(result, message);
  return message;
}

CaseResult from_message(const PointResult& message) {
  CaseResult result{};
  read_scalars<double>(message.reals(), result);
  read_scalars<std::int64_t>(message.whole_numbers(), result);
  read_scalars<std::string>(message.texts(), result);
  read_lists(message, result);
  return result;
}

PointResult failed_point(std::uint64_t point, const std::string& reason) {
  PointResult message;
  message.set_point(point);
  message.set_error(reason.empty() ? "unknown" : reason);
  return message;
}

std::string fault_of(const PointResult& message) {
  const auto is_too_long = [](const std::string& text) { return text.size() > kLongestText; };
  if (is_too_long(message.error()) ||
      std::any_of(message.texts().begin(), message.texts().end(), is_too_long)) {
    return "the worker sent a text that is too long";
  }
  if (message.ByteSizeLong() > kMaxResultBytes) {
    return fmt::format("the worker sent a result of {} bytes; at most {} are allowed",
                       message.ByteSizeLong(), kMaxResultBytes);
  }
  if (!message.error().empty()) {
    return {};
  }
  for (std::string fault :
       {fault_of_scalars<double>(message.reals(), "real numbers"),
        fault_of_scalars<std::int64_t>(message.whole_numbers(), "whole numbers"),
        fault_of_scalars<std::string>(message.texts(), "texts")}) {
    if (!fault.empty()) {
      return fault;
    }
  }
  return fault_of_lists(message);
}

std::string fault_of_trace(const Trace& trace, const solver::TraceShape& shape, bool with_fall) {
  const std::string& states = trace.states();
  const std::size_t numbers = solver::trace_numbers(shape);
  if (static_cast<std::size_t>(trace.values_size()) != states.size() * numbers) {
    return "its rows have other columns than a trace of this model";
  }
  if (std::any_of(states.begin(), states.end(), [](char state) {
        return static_cast<unsigned char>(state) >= solver::kTraceStates.size();
      })) {
    return "it has an unknown state";
  }
  const auto touch = states.find_first_not_of(static_cast<char>(solver::kFallingCode));
  if (touch != std::string::npos &&
      states.find(static_cast<char>(solver::kFallingCode), touch) != std::string::npos) {
    return "it has rows of the fall after the touch";
  }
  if (!with_fall && touch != 0 && !states.empty()) {
    return "it has rows of the fall, which were not requested";
  }
  if (!std::all_of(trace.values().begin(), trace.values().end(),
                   [](double value) { return std::isfinite(value); })) {
    return "it has a value that is not finite";
  }
  // If `every` is above 1, the trace is too long for a message and has no rows.
  if (states.empty() && trace.result().error().empty() && trace.every() <= 1) {
    return "it has no rows";
  }
  return fault_of(trace.result());
}

void set_protocol(WorkerHello& hello) {
  hello.set_protocol_version(kProtocolVersion);
  hello.set_outputs(sent_outputs());
}

std::string sent_outputs() {
  std::string names;
  const auto add = [&](const ResultField& field, const auto&) {
    names.append(names.empty() ? "" : " ").append(field.column);
  };
  for_each_sent<double>(add);
  for_each_sent<std::int64_t>(add);
  for_each_sent<std::string>(add);
  return names;
}

std::string hello_error(const WorkerHello& hello) {
  std::string error = version_error(hello.protocol_version(), "worker");
  if (error.empty() && hello.outputs() != sent_outputs()) {
    return "its results have other outputs than this server stores: install the same "
           "release on both";
  }
  return error;
}

}  // namespace oblique::protocol
