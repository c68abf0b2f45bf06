#include "proto/result_message.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::protocol {
namespace {

using solver::CaseResult;
using solver::for_each_sent;
using solver::Member;
using solver::PhaseKind;
using solver::ResultField;
using Numbers = google::protobuf::RepeatedField<double>;

/// Longest text that a result may have, in bytes.
constexpr std::size_t kLongestText = 65536;

template <class T>
int number_sent() {
  int number = 0;
  for_each_sent<T>([&](const ResultField&, const Member<T>&) { ++number; });
  return number;
}

void add_lists(const CaseResult& result, PointResult& message) {
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    const solver::Peak& peak = result.peaks[i];
    message.add_peaks(peak.t_s);
    message.add_peaks(peak.fn_N);
    message.add_peaks(peak.ft_N);
    if (peak.major) {
      message.add_major_peaks(static_cast<std::uint32_t>(i));
    }
  }
  for (const solver::TangentialPeak& peak : result.ft_peaks) {
    message.add_ft_peaks(peak.t_s);
    message.add_ft_peaks(peak.ft_N);
  }
  for (const solver::Phase& phase : result.phases) {
    message.add_phase_ends_s(phase.t1_s);
  }
  for (const solver::StickInterval& interval : result.stick_intervals) {
    message.add_stick_intervals(interval.t0_s);
    message.add_stick_intervals(interval.t1_s);
  }
  for (const solver::ReactionPeak& peak : result.reaction_peaks) {
    message.add_reaction_peaks(peak.t_s);
    message.add_reaction_peaks(peak.force_N);
  }
}

/// Calls `take` with each pair of a flat list.
template <class Take>
void for_each_pair(const Numbers& numbers, const Take& take) {
  for (int i = 0; i + 1 < numbers.size(); i += 2) {
    take(numbers[i], numbers[i + 1]);
  }
}

void read_peaks(const PointResult& message, CaseResult& result) {
  result.peaks.reserve(static_cast<std::size_t>(message.peaks_size() / 3));
  result.ft_peaks.reserve(static_cast<std::size_t>(message.ft_peaks_size() / 2));
  for (int i = 0; i + 2 < message.peaks_size(); i += 3) {
    result.peaks.push_back({message.peaks(i), message.peaks(i + 1), message.peaks(i + 2), false});
  }
  for (const std::uint32_t number : message.major_peaks()) {
    if (number < result.peaks.size()) {
      result.peaks[number].major = true;
    }
  }
  for_each_pair(message.ft_peaks(), [&](double t_s, double ft_N) {
    result.ft_peaks.push_back({t_s, ft_N});
  });
}

void read_lists(const PointResult& message, CaseResult& result) {
  read_peaks(message, result);
  result.phases.reserve(static_cast<std::size_t>(message.phase_ends_s_size()));
  result.stick_intervals.reserve(static_cast<std::size_t>(message.stick_intervals_size() / 2));
  result.reaction_peaks.reserve(static_cast<std::size_t>(message.reaction_peaks_size() / 2));
  double begin_s = 0.0;
  for (const double end_s : message.phase_ends_s()) {
    const bool compresses = result.phases.size() % 2 == 0;
    result.phases.push_back(
        {compresses ? PhaseKind::kCompression : PhaseKind::kRestitution, begin_s, end_s});
    begin_s = end_s;
  }
  for_each_pair(message.stick_intervals(), [&](double t0_s, double t1_s) {
    result.stick_intervals.push_back({t0_s, t1_s});
  });
  for_each_pair(message.reaction_peaks(), [&](double t_s, double force_N) {
    result.reaction_peaks.push_back({t_s, force_N});
  });
}

/// Reads the scalars of one type, as far as they go.
template <class Values>
void read_sent(const Values& values, CaseResult& result) {
  int i = 0;
  for_each_sent<typename Values::value_type>([&](const ResultField&, const auto& member) {
    if (i < values.size()) {
      member.in(result) = values[i++];
    }
  });
}

bool all_finite(const Numbers& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); });
}

std::string fault_of_lists(const PointResult& message) {
  for (const Numbers* numbers : {&message.peaks(), &message.ft_peaks(), &message.phase_ends_s(),
                                 &message.stick_intervals(), &message.reaction_peaks()}) {
    if (!all_finite(*numbers)) {
      return "the worker sent a list with a number that is not finite";
    }
  }
  if (message.peaks_size() % 3 != 0 || message.ft_peaks_size() % 2 != 0 ||
      message.stick_intervals_size() % 2 != 0 || message.reaction_peaks_size() % 2 != 0) {
    return "the worker sent a list of the wrong length";
  }
  const auto peaks = static_cast<std::uint32_t>(message.peaks_size() / 3);
  if (std::any_of(message.major_peaks().begin(), message.major_peaks().end(),
                  [&](std::uint32_t number) { return number >= peaks; })) {
    return "the worker sent the number of a major peak that is not there";
  }
  return {};
}

std::string fault_of_scalars(const PointResult& message) {
  const int reals = number_sent<double>();
  const int whole_numbers = number_sent<std::int64_t>();
  const int texts = number_sent<std::string>();
  if (message.reals_size() != reals || message.whole_numbers_size() != whole_numbers ||
      message.texts_size() != texts) {
    return fmt::format(
        "the worker sent {} real numbers, {} whole ones and {} texts, and a result "
        "has {}, {} and {}",
        message.reals_size(), message.whole_numbers_size(), message.texts_size(), reals,
        whole_numbers, texts);
  }
  std::string fault;
  int i = 0;
  for_each_sent<double>([&](const ResultField& field, const Member<double>&) {
    if (!std::isfinite(message.reals(i++)) && fault.empty()) {
      fault = fmt::format("the worker sent a {} that is not a finite number", field.column);
    }
  });
  return fault;
}

bool is_too_long(const std::string& text) {
  return text.size() > kLongestText;
}

}  // namespace

PointResult to_message(std::uint64_t point, const CaseResult& result) {
  PointResult message;
  message.set_point(point);
  for_each_sent<double>([&](const ResultField&, const Member<double>& member) {
    message.add_reals(member.of(result));
  });
  for_each_sent<std::int64_t>([&](const ResultField&, const Member<std::int64_t>& member) {
    message.add_whole_numbers(member.of(result));
  });
  for_each_sent<std::string>([&](const ResultField&, const Member<std::string>& member) {
    message.add_texts(member.of(result));
  });
  add_lists(result, message);
  return message;
}

CaseResult from_message(const PointResult& message) {
  CaseResult result{};
  read_sent(message.reals(), result);
  read_sent(message.whole_numbers(), result);
  read_sent(message.texts(), result);
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
  if (!message.error().empty()) {
    return {};
  }
  std::string fault = fault_of_scalars(message);
  return fault.empty() ? fault_of_lists(message) : fault;
}

void say_protocol(WorkerHello& hello) {
  hello.set_protocol_version(kProtocolVersion);
  hello.set_outputs(sent_outputs());
}

std::string sent_outputs() {
  std::string names;
  const auto add = [&](const ResultField& field, const auto&) {
    names += names.empty() ? "" : " ";
    names += field.column;
  };
  for_each_sent<double>(add);
  for_each_sent<std::int64_t>(add);
  for_each_sent<std::string>(add);
  return names;
}

std::string objection_to_worker(const WorkerHello& hello) {
  std::string objection =
      objection_to_version(hello.protocol_version(), kOldestWorkersVersion, "worker");
  if (objection.empty() && hello.outputs() != sent_outputs()) {
    return "its results have other outputs than those that are stored here: install the same "
           "release on both";
  }
  return objection;
}

}  // namespace oblique::protocol
