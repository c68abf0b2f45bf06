#include "proto/result_message.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>

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
using WholeNumbers = google::protobuf::RepeatedField<std::int64_t>;
using Texts = google::protobuf::RepeatedPtrField<std::string>;

/// Longest text that a result may have, in bytes.
constexpr std::size_t kLongestText = 65536;

// Scalars travel by type. What a result lacks has a value that no result has.

const Numbers& sent(const PointResult& message, double /*type*/) {
  return message.reals();
}
const WholeNumbers& sent(const PointResult& message, std::int64_t /*type*/) {
  return message.whole_numbers();
}
const Texts& sent(const PointResult& message, const std::string& /*type*/) {
  return message.texts();
}

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kNoWholeNumber = std::numeric_limits<std::int64_t>::min();

bool is_absent(double value) {
  return std::isnan(value);
}
bool is_absent(std::int64_t value) {
  return value == kNoWholeNumber;
}
bool is_absent(const std::string& value) {
  return value.empty();
}

/// Appends the scalars of type T.
template <class T, class Values>
void add_scalars(const CaseResult& result, const T& absent, Values& values) {
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    const T* value = member.of(result);
    *values.Add() = value != nullptr ? *value : absent;
  });
}

/// Reads the scalars of type T, as far as there are any.
template <class T>
void read_scalars(const PointResult& message, CaseResult& result) {
  const auto& values = sent(message, T{});
  int i = 0;
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    if (i < values.size() && !(member.may_be_absent && is_absent(values[i]))) {
      member.in(result) = values[i];
    }
    ++i;
  });
}

void add_lists(const CaseResult& result, PointResult& message) {
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    const solver::Peak& peak = result.peaks[i];
    for (const double number : {peak.t_s, peak.fn_N, peak.ft_N}) {
      message.add_peaks(number);
    }
    if (peak.major) {
      message.add_major_peaks(static_cast<std::uint32_t>(i));
    }
  }
  for (const auto& [t_s, ft_N] : result.ft_peaks) {
    message.add_ft_peaks(t_s);
    message.add_ft_peaks(ft_N);
  }
  for (const solver::Phase& phase : result.phases) {
    message.add_phase_ends_s(phase.t1_s);
  }
  for (const auto& [t0_s, t1_s] : result.stick_intervals) {
    message.add_stick_intervals(t0_s);
    message.add_stick_intervals(t1_s);
  }
  for (const auto& [t_s, force_N] : result.reaction_peaks) {
    message.add_reaction_peaks(t_s);
    message.add_reaction_peaks(force_N);
  }
}

/// Appends each pair of a flat list.
template <class Element>
void read_pairs(const Numbers& numbers, std::vector<Element>& list) {
  list.reserve(static_cast<std::size_t>(numbers.size() / 2));
  for (int i = 0; i + 1 < numbers.size(); i += 2) {
    list.push_back({numbers[i], numbers[i + 1]});
  }
}

void read_lists(const PointResult& message, CaseResult& result) {
  result.peaks.reserve(static_cast<std::size_t>(message.peaks_size() / 3));
  for (int i = 0; i + 2 < message.peaks_size(); i += 3) {
    result.peaks.push_back({message.peaks(i), message.peaks(i + 1), message.peaks(i + 2), false});
  }
  for (const std::uint32_t number : message.major_peaks()) {
    if (number < result.peaks.size()) {
      result.peaks[number].major = true;
    }
  }
  read_pairs(message.ft_peaks(), result.ft_peaks);
  read_pairs(message.stick_intervals(), result.stick_intervals);
  read_pairs(message.reaction_peaks(), result.reaction_peaks);
  result.phases.reserve(static_cast<std::size_t>(message.phase_ends_s_size()));
  double begin_s = 0.0;
  for (const double end_s : message.phase_ends_s()) {
    const bool compresses = result.phases.size() % 2 == 0;
    result.phases.push_back(
        {compresses ? PhaseKind::kCompression : PhaseKind::kRestitution, begin_s, end_s});
    begin_s = end_s;
  }
}

/// What is wrong with a number, as "is not a finite number"; nullptr: nothing.
const char* fault_of_number(double number) {
  if (std::abs(number) <= kLargestOutput) {
    return nullptr;
  }
  return std::isfinite(number) ? "is too large to be stored" : "is not a finite number";
}

std::string fault_of_lists(const PointResult& message) {
  struct List {
    const char* name;
    const Numbers* numbers;
    int per_element;
  };
  for (const List& list : {List{"peaks", &message.peaks(), 3},
                           {"ft_peaks", &message.ft_peaks(), 2},
                           {"phases", &message.phase_ends_s(), 1},
                           {"stick_intervals", &message.stick_intervals(), 2},
                           {"reaction_peaks", &message.reaction_peaks(), 2}}) {
    if (list.numbers->size() / list.per_element > kMostListElements) {
      return fmt::format("the worker sent {} {}, and a result has at most {}",
                         list.numbers->size() / list.per_element, list.name, kMostListElements);
    }
    if (list.numbers->size() % list.per_element != 0) {
      return fmt::format("the worker sent {} of the wrong length", list.name);
    }
    for (const double number : *list.numbers) {
      if (const char* fault = fault_of_number(number)) {
        return fmt::format("the worker sent a number in {} that {}", list.name, fault);
      }
    }
  }
  const auto peaks = static_cast<std::uint32_t>(message.peaks_size() / 3);
  const bool are_peaks = std::all_of(message.major_peaks().begin(), message.major_peaks().end(),
                                     [&](std::uint32_t number) { return number < peaks; });
  return are_peaks ? "" : "the worker sent the number of a major peak that does not exist";
}

/// The first fault of the scalars of type T, or an empty text.
template <class T>
std::string fault_of_scalars(const PointResult& message, const char* what) {
  const auto& values = sent(message, T{});
  int number = 0;
  std::string fault;
  for_each_sent<T>([&](const ResultField& field, const Member<T>& member) {
    const int i = number++;
    if (i >= values.size() || !fault.empty() || (member.may_be_absent && is_absent(values[i]))) {
      return;
    }
    if constexpr (std::is_same_v<T, double>) {
      const char* const found = fault_of_number(values[i]);
      fault =
          found == nullptr ? "" : fmt::format("the worker sent a {} that {}", field.column, found);
    }
  });
  return values.size() == number ? fault
                                 : fmt::format("the worker sent {} {}, and a result has {}",
                                               values.size(), what, number);
}

bool is_too_long(const std::string& text) {
  return text.size() > kLongestText;
}

}  // namespace

PointResult to_message(std::uint64_t point, const CaseResult& result) {
  PointResult message;
  message.set_point(point);
  add_scalars(result, kNoNumber, *message.mutable_reals());
  add_scalars(result, kNoWholeNumber, *message.mutable_whole_numbers());
  add_scalars(result, std::string(), *message.mutable_texts());
  add_lists(result, message);
  return message;
}

CaseResult from_message(const PointResult& message) {
  CaseResult result{};
  read_scalars<double>(message, result);
  read_scalars<std::int64_t>(message, result);
  read_scalars<std::string>(message, result);
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
  if (is_too_long(message.error()) ||
      std::any_of(message.texts().begin(), message.texts().end(), is_too_long)) {
    return "the worker sent a text that is too long";
  }
  if (message.ByteSizeLong() > kMostResultBytes) {
    return fmt::format("the worker sent a result of {} bytes, and one has at most {}",
                       message.ByteSizeLong(), kMostResultBytes);
  }
  if (!message.error().empty()) {
    return {};
  }
  for (std::string fault : {fault_of_scalars<double>(message, "real numbers"),
                            fault_of_scalars<std::int64_t>(message, "whole numbers"),
                            fault_of_scalars<std::string>(message, "texts")}) {
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
  const auto code = [](char state) { return static_cast<unsigned char>(state); };
  if (std::any_of(states.begin(), states.end(),
                  [&](char state) { return code(state) >= solver::kTraceStates.size(); })) {
    return "it has a state that no contact has";
  }
  const auto falls = [&](char state) { return code(state) == solver::kFallingCode; };
  if (!std::is_partitioned(states.begin(), states.end(), falls)) {
    return "it falls again after the touch";
  }
  if (!with_fall && !states.empty() && falls(states.front())) {
    return "it has rows of the fall that were not requested";
  }
  if (!std::all_of(trace.values().begin(), trace.values().end(),
                   [](double value) { return std::isfinite(value); })) {
    return "it has a value that is not finite";
  }
  const bool names_every = trace.every() > 1;  // with which it is short enough
  if (states.empty() && trace.result().error().empty() && !names_every) {
    return "it has no instant";
  }
  return fault_of(trace.result());
}

void say_protocol(WorkerHello& hello) {
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

std::string objection_to_worker(const WorkerHello& hello) {
  std::string objection = objection_to_version(hello.protocol_version(), "worker");
  if (objection.empty() && hello.outputs() != sent_outputs()) {
    return "its results have other outputs than those that are stored here: install the same "
           "release on both";
  }
  return objection;
}

}  // namespace oblique::protocol
