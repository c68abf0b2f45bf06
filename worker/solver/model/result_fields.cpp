#include "worker/solver/model/result_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

namespace oblique::solver {
namespace {

/// A member that every result has.
template <class T>
struct Held {
  using Value = T;
  static constexpr bool kMayBeAbsent = false;
  static const T* of(const T& member) { return &member; }
  static T& in(T& member) { return member; }
};

/// One that results may lack.
template <class T>
struct Held<std::optional<T>> {
  using Value = T;
  static constexpr bool kMayBeAbsent = true;
  static const T* of(const std::optional<T>& member) { return member ? &*member : nullptr; }
  static T& in(std::optional<T>& member) { return member ? *member : member.emplace(); }
};

/// The member that is reached by these steps from a CaseResult.
template <auto... steps>
constexpr auto at = [] {
  using Kind = Held<std::remove_cvref_t<decltype((std::declval<CaseResult&>().*....*steps))>>;
  using Value = typename Kind::Value;
  return Member<Value>{
      [](const CaseResult& result) -> const Value* { return Kind::of((result.*....*steps)); },
      [](CaseResult& result) -> Value& { return Kind::in((result.*....*steps)); },
      Kind::kMayBeAbsent};
}();

/// That member of the n-th peak, from 1, of those that are left when ripples are merged.
template <int n, double Peak::*member>
constexpr Member<double> of_major_peak{[](const CaseResult& result) -> const double* {
                                         int number = 0;
                                         for (const Peak& peak : result.peaks) {
                                           if (peak.major && ++number == n) {
                                             return &(peak.*member);
                                           }
                                         }
                                         return nullptr;
                                       },
                                       nullptr, true};

template <class... Values>
std::array<Cell, sizeof...(Values)> element(Values... values) {
  return {Cell(values)...};
}

// What the members of elements are called, in the database's views too.
constexpr std::array<std::string_view, 4> kPeakMembers{"t_s", "fn_N", "ft_N", "major"};
constexpr std::array<std::string_view, 2> kFtPeakMembers{"t_s", "ft_N"};
constexpr std::array<std::string_view, 3> kPhaseMembers{"kind", "t0_s", "t1_s"};
constexpr std::array<std::string_view, 2> kStickMembers{"t0_s", "t1_s"};
constexpr std::array<std::string_view, 2> kReactionMembers{"t_s", "force_N"};

constexpr ResultList kPeaks{
    .column = "peaks",
    .unit = "s, N",
    .meaning =
        "peaks of the normal force, ripples included: t_s from touch, fn_N, ft_N the largest "
        "tangential magnitude around the peak, major 1 or, for a ripple, 0; peaks[1] may be a "
        "ripple, the second major peak is major_peak_2_N",
    .members = kPeakMembers,
    .each = [](const CaseResult& result, const TakeElement& take) {
      for (const Peak& peak : result.peaks) {
        take(element(peak.t_s, peak.fn_N, peak.ft_N, peak.major));
      }
    }};

constexpr ResultList kFtPeaks{
    .column = "ft_peaks",
    .unit = "s, N",
    .meaning = "every peak of the tangential magnitude: t_s counted from touch and ft_N",
    .members = kFtPeakMembers,
    .each = [](const CaseResult& result, const TakeElement& take) {
      for (const TangentialPeak& peak : result.ft_peaks) {
        take(element(peak.t_s, peak.ft_N));
      }
    }};

constexpr ResultList kPhases{
    .column = "phases",
    .unit = "s",
    .meaning = "intervals of compression and restitution: kind, t0_s, t1_s, counted from touch",
    .members = kPhaseMembers,
    .each = [](const CaseResult& result, const TakeElement& take) {
      for (const Phase& phase : result.phases) {
        take(element(phase_kind_name(phase.kind), phase.t0_s, phase.t1_s));
      }
    }};

constexpr ResultList kStickIntervals{.column = "stick_intervals",
                                     .unit = "s",
                                     .meaning = "the same as stick_intervals_s",
                                     .members = kStickMembers,
                                     .has_names = false,
                                     .each = [](const CaseResult& result, const TakeElement& take) {
                                       for (const StickInterval& stick : result.stick_intervals) {
                                         take(element(stick.t0_s, stick.t1_s));
                                       }
                                     }};

constexpr ResultList kReactionPeaks{
    .column = "reaction_peaks",
    .unit = "s, N",
    .meaning =
        "largest force on the outer link at the pin O, then at each joint: t_s, its instant "
        "counted from touch, and force_N, its magnitude",
    .members = kReactionMembers,
    .each = [](const CaseResult& result, const TakeElement& take) {
      for (const ReactionPeak& peak : result.reaction_peaks) {
        take(element(peak.t_s, peak.force_N));
      }
    }};

constexpr std::array kLists{&kPeaks, &kFtPeaks, &kPhases, &kStickIntervals, &kReactionPeaks};

constexpr ResultField output(std::string_view name, std::string_view unit, std::string_view meaning,
                             decltype(ResultField::value) value) {
  return {.name = name,
          .column = name,
          .unit = unit,
          .meaning = meaning,
          .value = value,
          .shown_unit = unit};
}

/// As a member of that object of `solve --json`.
constexpr ResultField in_group(std::string_view group, ResultField field,
                               std::string_view column = {}) {
  field.group = group;
  field.column = column.empty() ? field.name : column;
  return field;
}

constexpr ResultField shown_in(std::string_view unit, double per_unit, ResultField field) {
  field.shown_unit = unit;
  field.shown_per_unit = per_unit;
  return field;
}

constexpr ResultField sent(SentWith sent_with, ResultField field) {
  field.sent_with = sent_with;
  return field;
}

constexpr std::array kFields{
    output("fall_time_s", "s", "time from rest to touch", at<&CaseResult::fall_time_s>),
    output("impact_x_m", "m", "where the tip lands: distance from the pin O along the ground",
           at<&CaseResult::impact_x_m>),
    output("vt_in_m_s", "m/s",
           "tangential velocity of the tip at touch, along x; negative: towards the pin",
           at<&CaseResult::vt_in_m_s>),
    output("vn_in_m_s", "m/s",
           "normal velocity of the tip at touch, upwards; negative: into the ground",
           at<&CaseResult::vn_in_m_s>),
    shown_in("us", 1e6,
             output("duration_s", "s", "duration of contact, from touch to separation",
                    at<&CaseResult::duration_s>)),
    output("fn_peak_N", "N",
           "largest normal force; forces act on the tip, the normal one upwards, never negative",
           at<&CaseResult::fn_peak_N>),
    output("ft_peak_N", "N", "largest magnitude of the tangential force",
           at<&CaseResult::ft_peak_N>),
    output("fn_peaks_N", "N",
           "every peak of the normal force, ripples included, in order of time; the second one "
           "that is no ripple is major_peak_2_N",
           ListPart{&kPeaks, "fn_N"}),
    output("ft_peaks_N", "N",
           "every peak of the magnitude of the tangential force, in order of time",
           ListPart{&kFtPeaks, "ft_N"}),
    output("major_peaks_N", "N", "the peaks of the normal force left when ripples are merged",
           ListPart{&kPeaks, "fn_N", "major"}),
    sent(SentWith::kPeaks,
         output("major_peak_1_N", "N", "first peak of the normal force, ripples merged",
                of_major_peak<1, &Peak::fn_N>)),
    sent(SentWith::kPeaks,
         output("major_peak_2_N", "N",
                "second peak of the normal force, ripples merged; NULL: there is none",
                of_major_peak<2, &Peak::fn_N>)),
    sent(SentWith::kPeaks,
         output("major_peak_3_N", "N",
                "third peak of the normal force, ripples merged; NULL: there is none",
                of_major_peak<3, &Peak::fn_N>)),
    sent(SentWith::kPeaks,
         shown_in("us", 1e6,
                  output("major_peak_1_t_s", "s", "when major_peak_1_N is reached, from touch",
                         of_major_peak<1, &Peak::t_s>))),
    sent(SentWith::kPeaks,
         shown_in("us", 1e6,
                  output("major_peak_2_t_s", "s", "when major_peak_2_N is reached, from touch",
                         of_major_peak<2, &Peak::t_s>))),
    sent(SentWith::kPeaks,
         shown_in("us", 1e6,
                  output("major_peak_3_t_s", "s", "when major_peak_3_N is reached, from touch",
                         of_major_peak<3, &Peak::t_s>))),
    output("impulse_n_Ns", "N s", "impulse of the normal force, upwards",
           at<&CaseResult::impulse_n_Ns>),
    output("impulse_t_Ns", "N s",
           "impulse of the tangential force, along x; positive: away from the pin",
           at<&CaseResult::impulse_t_Ns>),
    shown_in("mm", 1e3,
             output("slide_m", "m",
                    "length of the path of the contact particle P along the ground, there and back "
                    "both counted",
                    at<&CaseResult::slide_m>)),
    output("vt_out_m_s", "m/s",
           "tangential velocity of the tip at separation, along x; negative: towards the pin",
           at<&CaseResult::vt_out_m_s>),
    output("vn_out_m_s", "m/s",
           "normal velocity of the tip at separation, upwards; positive: off the ground",
           at<&CaseResult::vn_out_m_s>),
    output("mode", "", "order of states: S stick, s slip; C compression, R restitution",
           at<&CaseResult::mode>),
    output("major_mode", "", "the same with ripples merged", at<&CaseResult::major_mode>),
    output("margin", "",
           "how far the contact kept from another order of events, from 0; near 0 the mode is not "
           "to be trusted",
           at<&CaseResult::margin>),
    output("margin_event", "", "the event that came so near to happening, or to not happening",
           at<&CaseResult::margin_event>),
    shown_in("us", 1e6,
             output("stick_total_s", "s", "total time in stick", at<&CaseResult::stick_total_s>)),
    output("stick_intervals_s", "s",
           "spans in which P does not move: [from, to], counted from touch",
           ListPart{&kStickIntervals}),
    output(kPhases.column, kPhases.unit, kPhases.meaning, ListPart{&kPhases}),
    output(kReactionPeaks.column, kReactionPeaks.unit, kReactionPeaks.meaning,
           ListPart{&kReactionPeaks}),
    in_group("energy", output("kinetic_in_J", "J", "kinetic energy of the whole finger at touch",
                              at<&CaseResult::energy, &ContactEnergy::kinetic_in_J>)),
    in_group("energy",
             output("friction_J", "J", "energy lost to friction at P; what is lost is positive",
                    at<&CaseResult::energy, &ContactEnergy::friction_J>)),
    in_group("energy", output("restitution_J", "J",
                              "energy lost in the normal contact element; what is lost is positive",
                              at<&CaseResult::energy, &ContactEnergy::restitution_J>)),
    in_group("energy",
             output("kinetic_change_J", "J", "kinetic energy at separation less that at touch",
                    at<&CaseResult::energy, &ContactEnergy::kinetic_change_J>)),
    in_group("energy", output("strain_change_J", "J",
                              "strain energy of the links at separation less that at touch",
                              at<&CaseResult::energy, &ContactEnergy::strain_change_J>)),
    in_group("energy",
             output("gravity_change_J", "J", "potential energy at separation less that at touch",
                    at<&CaseResult::energy, &ContactEnergy::gravity_change_J>)),
    in_group(
        "energy",
        output("exchanged_J", "J",
               "work that the contact forces exchanged with the finger, to and fro both counted",
               at<&CaseResult::energy, &ContactEnergy::exchanged_J>)),
    in_group(
        "energy",
        output(
            "closure", "",
            "what does not add up in the energy balance, relative to exchanged_J; never negative",
            at<&CaseResult::energy, &ContactEnergy::closure>)),
    in_group("errors",
             output("mode_same", "",
                    "1: half the mesh and twice the step give the same mode, ripples merged; 0: "
                    "another. This and the errors below are there only when they were asked for",
                    at<&CaseResult::errors, &ErrorEstimate::mode_same>),
             "mode_same"),
    in_group("errors",
             output("fn_peak", "", "estimated error of fn_peak_N, as a fraction of it",
                    at<&CaseResult::errors, &ErrorEstimate::fn_peak>),
             "fn_peak_error"),
    in_group("errors",
             output("ft_peak", "", "estimated error of ft_peak_N, as a fraction of fn_peak_N",
                    at<&CaseResult::errors, &ErrorEstimate::ft_peak>),
             "ft_peak_error"),
    in_group("errors",
             output("duration", "", "estimated error of duration_s, as a fraction of it",
                    at<&CaseResult::errors, &ErrorEstimate::duration>),
             "duration_error"),
    in_group(
        "errors",
        output("stick_total", "", "estimated error of stick_total_s, as a fraction of duration_s",
               at<&CaseResult::errors, &ErrorEstimate::stick_total>),
        "stick_total_error"),
    in_group("errors",
             output("slide", "",
                    "estimated error of slide_m, as a fraction of speed at touch times duration_s",
                    at<&CaseResult::errors, &ErrorEstimate::slide>),
             "slide_error"),
    in_group("errors",
             output("impulse_n", "", "estimated error of impulse_n_Ns, as a fraction of it",
                    at<&CaseResult::errors, &ErrorEstimate::impulse_n>),
             "impulse_n_error"),
    in_group(
        "errors",
        output("impulse_t", "", "estimated error of impulse_t_Ns, as a fraction of impulse_n_Ns",
               at<&CaseResult::errors, &ErrorEstimate::impulse_t>),
        "impulse_t_error"),
    in_group("errors",
             output("v_out", "",
                    "estimated error of the velocity at separation (vt_out_m_s and vn_out_m_s as "
                    "one vector), as a fraction of the speed at touch",
                    at<&CaseResult::errors, &ErrorEstimate::v_out>),
             "v_out_error"),
    sent(SentWith::kModel,
         in_group("solver",
                  output("integrator", "",
                         "how the equations of motion are stepped: explicit or generalized-alpha",
                         at<&CaseResult::solver, &SolverReport::integrator>))),
    shown_in("us", 1e6,
             in_group("solver",
                      output("dt_s", "s",
                             "step in contact, in compression; restitution at low e steps shorter",
                             at<&CaseResult::solver, &SolverReport::dt_s>))),
    in_group("solver", output("steps", "", "accepted steps in contact",
                              at<&CaseResult::solver, &SolverReport::steps>)),
    shown_in(
        "ms", 1e3,
        in_group("solver", output("wall_s", "s", "wall time of the contact alone; not reproducible",
                                  at<&CaseResult::solver, &SolverReport::wall_s>))),
    sent(SentWith::kWorker, in_group("solver",
                                     output("version", "", "version of the solver",
                                            at<&CaseResult::solver, &SolverReport::version>),
                                     "solver_version"))};

}  // namespace

std::span<const ResultField> result_fields() {
  return kFields;
}

std::span<const ResultList* const> result_lists() {
  return kLists;
}

const ResultField* find_result_column(std::string_view column) {
  const auto found = std::find_if(kFields.begin(), kFields.end(),
                                  [&](const ResultField& field) { return field.column == column; });
  return found == kFields.end() ? nullptr : &*found;
}

const ResultList* find_result_list(std::string_view column) {
  const auto found = std::find_if(kLists.begin(), kLists.end(),
                                  [&](const ResultList* list) { return list->column == column; });
  return found == kLists.end() ? nullptr : *found;
}

bool is_finite(const CaseResult& result) {
  bool finite = true;
  for_each_sent<double>([&](const ResultField&, const Member<double>& member) {
    const double* number = member.of(result);
    finite = finite && (number == nullptr || std::isfinite(*number));
  });
  for (const ResultList* list : kLists) {
    list->each(result, [&](std::span<const Cell> element) {
      for (const Cell& cell : element) {
        const auto* number = std::get_if<double>(&cell);
        finite = finite && (number == nullptr || std::isfinite(*number));
      }
    });
  }
  return finite;
}

}  // namespace oblique::solver
