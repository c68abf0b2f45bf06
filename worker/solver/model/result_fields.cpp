#include "worker/solver/model/result_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

namespace oblique::solver {
namespace {

/// Returns the name of a member, such as "H_m" for &CaseResult::H_m. Outputs have these names.
template <auto member>
constexpr std::string_view name_of() {
  constexpr std::string_view text = __PRETTY_FUNCTION__;
  constexpr std::size_t end = text.find_first_of(";]", text.find("member = "));
  constexpr std::size_t begin = text.rfind("::", end) + 2;
  return text.substr(begin, end - begin);
}
static_assert(name_of<&CaseResult::H_m>() == "H_m");

template <auto... members>
constexpr std::array kNames{name_of<members>()...};

template <class T>
const T* present(const T& member) {
  return &member;
}
template <class T>
const T* present(const std::optional<T>& member) {
  return member ? &*member : nullptr;
}
template <class T>
T& created(T& member) {
  return member;
}
template <class T>
T& created(std::optional<T>& member) {
  return member ? *member : member.emplace();
}

/// The member that the path `steps` of nested members reaches from a CaseResult.
template <auto... steps>
constexpr auto at = [] {
  using Kept = std::remove_cvref_t<decltype((std::declval<CaseResult&>().*....*steps))>;
  using Value = std::remove_reference_t<decltype(created(std::declval<Kept&>()))>;
  return Member<Value>{[](const CaseResult& result) { return present((result.*....*steps)); },
                       [](CaseResult& result) -> Value& { return created((result.*....*steps)); },
                       !std::is_same_v<Kept, Value>};
}();

/// A member of the n-th major peak, counted from 1; nullptr if there are fewer.
template <int n, double Peak::*member>
const double* major_peak(const CaseResult& result) {
  int number = 0;
  for (const Peak& peak : result.peaks) {
    if (peak.major && ++number == n) {
      return &(peak.*member);
    }
  }
  return nullptr;
}

template <class Value>
Cell cell(Value value) {
  return value;
}
Cell cell(PhaseKind kind) {
  return phase_kind_name(kind);
}

/// For each element of `list`, calls `take` with the `members` of the element.
template <auto list, auto... members>
void each_of(const CaseResult& result, const TakeElement& take) {
  for (const auto& element : result.*list) {
    const std::array<Cell, sizeof...(members)> cells{cell(element.*members)...};
    take(cells);
  }
}

using Result = CaseResult;
using Energy = ContactEnergy;
using Errors = ErrorEstimate;

/// A ResultList. Its column has the name of `list`, its values have the names of `members`.
template <auto list, auto... members>
constexpr ResultList list_of(std::string_view unit, std::string_view meaning,
                             bool has_names = true) {
  return {name_of<list>(), unit, meaning, kNames<members...>, each_of<list, members...>, has_names};
}

constexpr ResultList kPeaks =
    list_of<&Result::peaks, &Peak::t_s, &Peak::fn_N, &Peak::ft_N, &Peak::major>(
        "s, N",
        "peaks of the normal force, ripples included: t_s since touch, fn_N, ft_N the largest "
        "magnitude of the tangential force around the peak, major 1 or, for a ripple, 0; peaks[1] "
        "may be a ripple, the second major peak is major_peak_2_N");
constexpr ResultList kFtPeaks =
    list_of<&Result::ft_peaks, &TangentialPeak::t_s, &TangentialPeak::ft_N>(
        "s, N", "peaks of the magnitude of the tangential force: t_s since touch, and ft_N");
constexpr ResultList kPhases = list_of<&Result::phases, &Phase::kind, &Phase::t0_s, &Phase::t1_s>(
    "s", "intervals of compression and restitution: kind, t0_s, t1_s, counted from touch");
constexpr ResultList kStickIntervals =
    list_of<&Result::stick_intervals, &StickInterval::t0_s, &StickInterval::t1_s>(
        "s", "the same as stick_intervals_s", false);
constexpr ResultList kReactionPeaks =
    list_of<&Result::reaction_peaks, &ReactionPeak::t_s, &ReactionPeak::force_N>(
        "s, N",
        "largest force on the outer link at the pin O, then at each joint: t_s, its instant "
        "counted from touch, and force_N, its magnitude");

constexpr std::array kLists{&kPeaks, &kFtPeaks, &kPhases, &kStickIntervals, &kReactionPeaks};

/// An SI unit and the unit shown in tables for people.
struct Unit {
  constexpr Unit(const char* name) : si(name), shown(name) {}
  constexpr Unit(const char* name, const char* shown_name, double shown_per_si)
      : si(name), shown(shown_name), per_si(shown_per_si) {}

  std::string_view si;
  std::string_view shown;
  double per_si = 1.0;
};
constexpr Unit kMicroseconds{"s", "us", 1e6};
constexpr Unit kMilliseconds{"s", "ms", 1e3};
constexpr Unit kMillimetres{"m", "mm", 1e3};

constexpr ResultField output(std::string_view name, Unit unit, std::string_view meaning,
                             decltype(ResultField::value) value) {
  return {.name = name,
          .column = name,
          .unit = unit.si,
          .meaning = meaning,
          .value = value,
          .shown_unit = unit.shown,
          .shown_per_unit = unit.per_si};
}

template <auto member>
constexpr ResultField output(Unit unit, std::string_view meaning) {
  return output(name_of<member>(), unit, meaning, at<member>);
}

/// Output in an object of the result, such as the energy.
template <auto object, auto member>
constexpr ResultField output_of(std::string_view group, Unit unit, std::string_view meaning,
                                std::string_view column = name_of<member>(),
                                SentWith sent_with = SentWith::kResult) {
  ResultField field = output(name_of<member>(), unit, meaning, at<object, member>);
  field.group = group;
  field.column = column;
  field.sent_with = sent_with;
  return field;
}

template <int n, double Peak::*member>
constexpr ResultField output_of_peak(std::string_view name, Unit unit, std::string_view meaning) {
  ResultField field =
      output(name, unit, meaning, Member<double>{major_peak<n, member>, nullptr, true});
  field.sent_with = SentWith::kPeaks;
  return field;
}

template <auto member>
constexpr ResultField energy(std::string_view meaning, Unit unit = "J") {
  return output_of<&Result::energy, member>("energy", unit, meaning);
}

template <auto member>
constexpr ResultField error(std::string_view column, std::string_view meaning) {
  return output_of<&Result::errors, member>("errors", "", meaning, column);
}

template <auto member>
constexpr ResultField report(Unit unit, std::string_view meaning,
                             SentWith sent_with = SentWith::kResult) {
  return output_of<&Result::solver, member>(
      "solver", unit, meaning,
      sent_with == SentWith::kWorker ? "solver_version" : name_of<member>(), sent_with);
}

constexpr std::array kFields{
    output<&Result::fall_time_s>("s", "time from rest to touch"),
    output<&Result::impact_x_m>("m",
                                "where the tip lands: distance from the pin O along the ground"),
    output<&Result::vt_in_m_s>(
        "m/s", "tangential velocity of the tip at touch, along x; negative: towards the pin"),
    output<&Result::vn_in_m_s>(
        "m/s", "normal velocity of the tip at touch, upwards; negative: into the ground"),
    output<&Result::duration_s>(kMicroseconds, "duration of contact, from touch to separation"),
    output<&Result::fn_peak_N>(
        "N", "largest normal force; forces act on the tip, the normal one upwards, never negative"),
    output<&Result::ft_peak_N>("N", "largest magnitude of the tangential force"),
    output("fn_peaks_N", "N",
           "every peak of the normal force, ripples included, in order of time; the second one "
           "that is no ripple is major_peak_2_N",
           ListPart{&kPeaks, "fn_N"}),
    output("ft_peaks_N", "N",
           "every peak of the magnitude of the tangential force, in order of time",
           ListPart{&kFtPeaks, "ft_N"}),
    output("major_peaks_N", "N", "the peaks of the normal force left when ripples are merged",
           ListPart{&kPeaks, "fn_N", "major"}),
    output_of_peak<1, &Peak::fn_N>("major_peak_1_N", "N",
                                   "first peak of the normal force, ripples merged"),
    output_of_peak<2, &Peak::fn_N>(
        "major_peak_2_N", "N",
        "second peak of the normal force, ripples merged; NULL: there is none"),
    output_of_peak<3, &Peak::fn_N>(
        "major_peak_3_N", "N",
        "third peak of the normal force, ripples merged; NULL: there is none"),
    output_of_peak<1, &Peak::t_s>("major_peak_1_t_s", kMicroseconds,
                                  "when major_peak_1_N is reached, from touch"),
    output_of_peak<2, &Peak::t_s>("major_peak_2_t_s", kMicroseconds,
                                  "when major_peak_2_N is reached, from touch"),
    output_of_peak<3, &Peak::t_s>("major_peak_3_t_s", kMicroseconds,
                                  "when major_peak_3_N is reached, from touch"),
    output<&Result::impulse_n_Ns>("N s", "impulse of the normal force, upwards"),
    output<&Result::impulse_t_Ns>(
        "N s", "impulse of the tangential force, along x; positive: away from the pin"),
    output<&Result::slide_m>(
        kMillimetres,
        "length of the path of the contact particle P along the ground, in both directions"),
    output<&Result::vt_out_m_s>(
        "m/s", "tangential velocity of the tip at separation, along x; negative: towards the pin"),
    output<&Result::vn_out_m_s>(
        "m/s", "normal velocity of the tip at separation, upwards; positive: off the ground"),
    output<&Result::mode>("", "order of states: S stick, s slip; C compression, R restitution"),
    output<&Result::major_mode>("", "the same with ripples merged"),
    output<&Result::margin>(
        "",
        "distance of the contact from another order of events, at least 0; near 0 the mode is "
        "uncertain"),
    output<&Result::margin_event>(
        "", "the event that determines margin: it nearly occurred, or nearly did not"),
    output<&Result::stick_total_s>(kMicroseconds, "total time in stick"),
    output("stick_intervals_s", "s",
           "spans in which P does not move: [from, to], counted from touch",
           ListPart{&kStickIntervals}),
    output("phases", "s", kPhases.meaning, ListPart{&kPhases}),
    output("reaction_peaks", "s, N", kReactionPeaks.meaning, ListPart{&kReactionPeaks}),
    energy<&Energy::kinetic_in_J>("kinetic energy of the whole finger at touch"),
    energy<&Energy::friction_J>("energy lost to friction at P; a loss is positive"),
    energy<&Energy::restitution_J>("energy lost in the normal contact element; a loss is positive"),
    energy<&Energy::kinetic_change_J>("kinetic energy at separation less that at touch"),
    energy<&Energy::strain_change_J>("strain energy of the links at separation less that at touch"),
    energy<&Energy::gravity_change_J>("potential energy at separation less that at touch"),
    energy<&Energy::exchanged_J>("work that the contact forces exchanged with the finger, counted "
                                 "positive in both directions"),
    energy<&Energy::closure>("absolute error of the energy balance, relative to exchanged_J", ""),
    error<&Errors::mode_same>(
        "mode_same",
        "1 if half the mesh and twice the step give the same mode, ripples merged; else 0. "
        "This and the errors below need errors = true or --errors"),
    error<&Errors::fn_peak>("fn_peak_error", "estimated error of fn_peak_N, as a fraction of it"),
    error<&Errors::ft_peak>("ft_peak_error",
                            "estimated error of ft_peak_N, as a fraction of fn_peak_N"),
    error<&Errors::duration>("duration_error",
                             "estimated error of duration_s, as a fraction of it"),
    error<&Errors::stick_total>("stick_total_error",
                                "estimated error of stick_total_s, as a fraction of duration_s"),
    error<&Errors::slide>("slide_error", "estimated error of slide_m, as a fraction of it"),
    error<&Errors::impulse_n>("impulse_n_error",
                              "estimated error of impulse_n_Ns, as a fraction of it"),
    error<&Errors::impulse_t>("impulse_t_error",
                              "estimated error of impulse_t_Ns, as a fraction of impulse_n_Ns"),
    error<&Errors::v_out>("v_out_error",
                          "estimated error of the velocity at separation (vt_out_m_s and "
                          "vn_out_m_s as one vector), as a fraction of the speed at touch"),
    report<&SolverReport::integrator>(
        "", "how the equations of motion are stepped: explicit or generalized-alpha",
        SentWith::kModel),
    report<&SolverReport::dt_s>(
        kMicroseconds, "step in contact, in compression; restitution at low e steps shorter"),
    report<&SolverReport::steps>("", "accepted steps in contact"),
    report<&SolverReport::wall_s>(kMilliseconds,
                                  "wall time of the contact alone; not reproducible"),
    report<&SolverReport::version>("", "version of the solver", SentWith::kWorker)};

}  // namespace

std::span<const ResultField> result_fields() {
  return kFields;
}

std::span<const ResultList* const> result_lists() {
  return kLists;
}

const ResultField* find_result_column(std::string_view column) {
  const auto* found = std::ranges::find(kFields, column, &ResultField::column);
  return found == kFields.end() ? nullptr : &*found;
}

const ResultList* find_result_list(std::string_view column) {
  const auto* found = std::ranges::find(kLists, column, &ResultList::column);
  return found == kLists.end() ? nullptr : *found;
}

bool is_finite(const CaseResult& result) {
  bool finite = true;
  const auto check = [&finite](const double* number) {
    finite = finite && (number == nullptr || std::isfinite(*number));
  };
  for_each_sent<double>(
      [&](const ResultField&, const Member<double>& member) { check(member.of(result)); });
  for (const ResultList* list : kLists) {
    list->each(result, [&](std::span<const Cell> element) {
      for (const Cell& cell : element) {
        check(std::get_if<double>(&cell));
      }
    });
  }
  return finite;
}

}  // namespace oblique::solver
