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

/// Calls `take` with every field that is sent with a result and its member, in the order of
/// `sent_outputs()`.
template <class Take>
void for_each_scalar(const Take& take) {
  for_each_sent<double>(take);
  for_each_sent<std::int64_t>(take);
  for_each_sent<std::string>(take);
}

/// The scalars of one type in a message.
const Numbers& sent(const PointResult& message, const Member<double>& /*type*/) {
  return message.reals();
}
const google::protobuf::RepeatedField<std::int64_t>& sent(const PointResult& message,
                                                          const Member<std::int64_t>& /*type*/) {
  return message.whole_numbers();
}
const google::protobuf::RepeatedPtrField<std::string>& sent(const PointResult& message,
                                                            const Member<std::string>& /*type*/) {
  return message.texts();
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

/// Told of one scalar after the other, says which of them a message lacks.
class AbsentScalars {
 public:
  explicit AbsentScalars(const PointResult& message) : absent_(message.absent()) {}

  /// Whether it lacks the next one.
  bool lacks_next() {
    const bool lacks =
        named_ < absent_.size() && absent_[named_] == static_cast<std::uint32_t>(place_);
    named_ += lacks ? 1 : 0;
    ++place_;
    return lacks;
  }
  /// Whether every place that the message names was come to.
  bool all_found() const { return named_ == absent_.size(); }

 private:
  const google::protobuf::RepeatedField<std::uint32_t>& absent_;
  int named_ = 0;
  int place_ = 0;
};

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

/// Reads the scalars of type T, as far as they go.
template <class T>
void read_sent(const PointResult& message, AbsentScalars& absent, CaseResult& result) {
  int i = 0;
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    const auto& values = sent(message, member);
    if (!absent.lacks_next() && i < values.size()) {
      member.in(result) = values[i++];
    }
  });
}

/// What is wrong with a number, as "is not a finite number"; nullptr: nothing.
const char* fault_of_number(double number) {
  if (std::abs(number) <= kLargestOutput) {
    return nullptr;
  }
  return std::isfinite(number) ? "is too large to be stored" : "is not a finite number";
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
    if (list.numbers->size() / list.per_element > kMostListElements) {
      return fmt::format("the worker sent {} {}, and a result has at most {}",
                         list.numbers->size() / list.per_element, list.name, kMostListElements);
    }
    for (const double number : *list.numbers) {
      if (const char* fault = fault_of_number(number)) {
        return fmt::format("the worker sent a number in {} that {}", list.name, fault);
      }
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

/// How many scalars of type T the message ought to have; adds to `wrongly_absent` those that no
/// result may lack.
template <class T>
int number_expected(AbsentScalars& absent, int& wrongly_absent) {
  int number = 0;
  for_each_sent<T>([&](const ResultField&, const Member<T>& member) {
    if (!absent.lacks_next()) {
      ++number;
    } else if (!member.may_be_absent) {
      ++wrongly_absent;
    }
  });
  return number;
}

std::string fault_of_scalars(const PointResult& message) {
  AbsentScalars absent(message);
  int wrongly_absent = 0;
  const int reals = number_expected<double>(absent, wrongly_absent);
  const int whole_numbers = number_expected<std::int64_t>(absent, wrongly_absent);
  const int texts = number_expected<std::string>(absent, wrongly_absent);
  if (wrongly_absent > 0 || !absent.all_found()) {
    return "the worker sent a result that lacks what no result may lack";
  }
  if (message.reals_size() != reals || message.whole_numbers_size() != whole_numbers ||
      message.texts_size() != texts) {
    return fmt::format(
        "the worker sent {} real numbers, {} whole ones and {} texts, and a result "
        "has {}, {} and {}",
        message.reals_size(), message.whole_numbers_size(), message.texts_size(), reals,
        whole_numbers, texts);
  }
  std::string fault;
  AbsentScalars passed(message);
  int i = 0;
  for_each_sent<double>([&](const ResultField& field, const Member<double>&) {
    if (passed.lacks_next()) {
      return;
    }
    const char* const found = fault_of_number(message.reals(i++));
    if (found != nullptr && fault.empty()) {
      fault = fmt::format("the worker sent a {} that {}", field.column, found);
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
  std::uint32_t place = 0;
  for_each_scalar([&](const ResultField&, const auto& member) {
    if (const auto* value = member.of(result)) {
      add(message, *value);
    } else {
      message.add_absent(place);
    }
    ++place;
  });
  add_lists(result, message);
  return message;
}

CaseResult from_message(const PointResult& message) {
  CaseResult result{};
  AbsentScalars absent(message);
  read_sent<double>(message, absent, result);
  read_sent<std::int64_t>(message, absent, result);
  read_sent<std::string>(message, absent, result);
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
