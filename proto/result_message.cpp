#include "proto/result_message.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <type_traits>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::protocol {
namespace {

using solver::CaseResult;
using solver::Member;
using solver::ResultField;
using Numbers = google::protobuf::RepeatedField<double>;

/// Longest text that a result may have, in bytes.
constexpr std::size_t kLongestText = 65536;

/// Calls `take` with every field that is sent with a result and its member, in the order of
/// `sent_outputs()`.
template <class Take>
void for_each_scalar(const Take& take) {
  solver::for_each_sent<double>(take);
  solver::for_each_sent<std::int64_t>(take);
  solver::for_each_sent<std::string>(take);
}

/// Stands for an output that a result lacks: NaN, the least whole number, or an empty text.
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
  if constexpr (std::is_same_v<T, double>) {
    return member.may_be_absent && std::isnan(value);
  } else {
    return member.may_be_absent && value == absent<T>();
  }
}

void add(PointResult& message, double value) {
  message.add_reals(value);
}
void add(PointResult& message, std::int64_t value) {
  message.add_whole_numbers(value);
}
void add(PointResult& message, const std::string& value) {
  message.add_texts(value);
}

/// Calls `take` with each field, its member and its value in the message. False if the message has
/// fewer or more scalars than there are fields.
template <class Take>
bool for_each_value(const PointResult& message, const Take& take) {
  const auto walk = [&take]<class T>(const auto& values, T /*type*/) {
    int i = 0;
    solver::for_each_sent<T>([&](const ResultField& field, const Member<T>& member) {
      if (i < values.size()) {
        take(field, member, values[i]);
      }
      ++i;
    });
    return i == values.size();
  };
  const bool has_reals = walk(message.reals(), double());
  const bool has_whole_numbers = walk(message.whole_numbers(), std::int64_t());
  const bool has_texts = walk(message.texts(), std::string());
  return has_reals && has_whole_numbers && has_texts;
}

void append(Numbers& list, std::initializer_list<double> element) {
  for (const double number : element) {
    list.Add(number);
  }
}

void add_lists(const CaseResult& result, PointResult& message) {
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    const solver::Peak& peak = result.peaks[i];
    append(*message.mutable_peaks(), {peak.t_s, peak.fn_N, peak.ft_N});
    if (peak.major) {
      message.add_major_peaks(static_cast<std::uint32_t>(i));
    }
  }
  for (const solver::TangentialPeak& peak : result.ft_peaks) {
    append(*message.mutable_ft_peaks(), {peak.t_s, peak.ft_N});
  }
  for (const solver::Phase& phase : result.phases) {
    message.add_phase_ends_s(phase.t1_s);
  }
  for (const solver::StickInterval& interval : result.stick_intervals) {
    append(*message.mutable_stick_intervals(), {interval.t0_s, interval.t1_s});
  }
  for (const solver::ReactionPeak& peak : result.reaction_peaks) {
    append(*message.mutable_reaction_peaks(), {peak.t_s, peak.force_N});
  }
}

/// Appends to `list` the pairs of a flat list.
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
  double begin_s = 0.0;
  for (const double end_s : message.phase_ends_s()) {
    const bool compresses = result.phases.size() % 2 == 0;
    result.phases.push_back(
        {compresses ? solver::PhaseKind::kCompression : solver::PhaseKind::kRestitution, begin_s,
         end_s});
    begin_s = end_s;
  }
  read_pairs(message.ft_peaks(), result.ft_peaks);
  read_pairs(message.stick_intervals(), result.stick_intervals);
  read_pairs(message.reaction_peaks(), result.reaction_peaks);
}

/// What is wrong with a number, as "is not a finite number"; nullptr: nothing.
const char* fault_of_number(double number) {
  return std::abs(number) <= kLargestOutput ? nullptr
         : std::isfinite(number)            ? "is too large to be stored"
                                            : "is not a finite number";
}

/// A list of a message, and how many of its numbers are an element of it.
struct List {
  const char* name;
  const Numbers* numbers;
  int per_element;
};

std::string fault_of_lists(const PointResult& message) {
  for (const List& list : {List{"peaks", &message.peaks(), 3},
                           {"ft_peaks", &message.ft_peaks(), 2},
                           {"phases", &message.phase_ends_s(), 1},
                           {"stick_intervals", &message.stick_intervals(), 2},
                           {"reaction_peaks", &message.reaction_peaks(), 2}}) {
    const int elements = list.numbers->size() / list.per_element;
    if (elements > kMostListElements) {
      return fmt::format("the worker sent {} {}, and a result has at most {}", elements, list.name,
                         kMostListElements);
    }
    if (list.numbers->size() % list.per_element != 0) {
      return fmt::format("the worker sent a list {} of the wrong length", list.name);
    }
    for (const double number : *list.numbers) {
      if (const char* fault = fault_of_number(number)) {
        return fmt::format("the worker sent a number in {} that {}", list.name, fault);
      }
    }
  }
  const auto peaks = static_cast<std::uint32_t>(message.peaks_size() / 3);
  const bool are_known = std::all_of(message.major_peaks().begin(), message.major_peaks().end(),
                                     [peaks](std::uint32_t number) { return number < peaks; });
  return are_known ? "" : "the worker sent the number of a major peak that is not there";
}

std::string fault_of_scalars(const PointResult& message) {
  std::string fault;
  const auto check = [&fault]<class T>(const ResultField& field, const Member<T>& member,
                                       const T& value) {
    if constexpr (std::is_same_v<T, double>) {
      const char* found = is_absent(member, value) ? nullptr : fault_of_number(value);
      if (found != nullptr && fault.empty()) {
        fault = fmt::format("the worker sent a {} that {}", field.column, found);
      }
    }
  };
  if (!for_each_value(message, check)) {
    return fmt::format(
        "the worker sent {} real numbers, {} whole ones and {} texts, which are not those of a "
        "result",
        message.reals_size(), message.whole_numbers_size(), message.texts_size());
  }
  return fault;
}

bool is_too_long(const std::string& text) {
  return text.size() > kLongestText;
}

}  // namespace

PointResult to_message(std::uint64_t point, const CaseResult& result) {
  PointResult message;
  message.set_point(point);
  for_each_scalar([&]<class T>(const ResultField&, const Member<T>& member) {
    const T* value = member.of(result);
    add(message, value != nullptr ? *value : absent<T>());
  });
  add_lists(result, message);
  return message;
}

CaseResult from_message(const PointResult& message) {
  CaseResult result{};
  for_each_value(message,
                 [&]<class T>(const ResultField&, const Member<T>& member, const T& value) {
                   if (!is_absent(member, value)) {
                     member.in(result) = value;
                   }
                 });
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
  std::string fault = fault_of_scalars(message);
  return fault.empty() ? fault_of_lists(message) : fault;
}

void say_protocol(WorkerHello& hello) {
  hello.set_protocol_version(kProtocolVersion);
  hello.set_outputs(sent_outputs());
}

std::string sent_outputs() {
  std::string names;
  for_each_scalar([&](const ResultField& field, const auto&) {
    names += names.empty() ? "" : " ";
    names += field.column;
  });
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
