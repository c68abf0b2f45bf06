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

constexpr std::string_view kEnergy = "energy";
constexpr std::string_view kErrors = "errors";
constexpr std::string_view kSolver = "solver";
constexpr auto kEnergyOf = &CaseResult::energy;
constexpr auto kErrorsOf = &CaseResult::errors;
constexpr auto kSolverOf = &CaseResult::solver;

template <int n>
constexpr ResultField major_peak_force(std::string_view name, std::string_view meaning) {
  return {.name = name,
          .unit = "N",
          .meaning = meaning,
          .value = of_major_peak<n, &Peak::fn_N>,
          .sent_with = SentWith::kPeaks};
}

template <int n>
constexpr ResultField major_peak_instant(std::string_view name, std::string_view meaning) {
  return {.name = name,
          .unit = "s",
          .meaning = meaning,
          .value = of_major_peak<n, &Peak::t_s>,
          .shown_unit = "us",
          .shown_per_unit = 1e6,
          .sent_with = SentWith::kPeaks};
}

constexpr std::array kFields{
    ResultField{.name = "fall_time_s",
                .unit = "s",
                .meaning = "time from rest to touch",
                .value = at<&CaseResult::fall_time_s>},
    ResultField{.name = "impact_x_m",
                .unit = "m",
                .meaning = "where the tip lands: distance from the pin O along the ground",
                .value = at<&CaseResult::impact_x_m>},
    ResultField{
        .name = "vt_in_m_s",
        .unit = "m/s",
        .meaning = "tangential velocity of the tip at touch, along x; negative: towards the pin",
        .value = at<&CaseResult::vt_in_m_s>},
    ResultField{
        .name = "vn_in_m_s",
        .unit = "m/s",
        .meaning = "normal velocity of the tip at touch, upwards; negative: into the ground",
        .value = at<&CaseResult::vn_in_m_s>},
    ResultField{.name = "duration_s",
                .unit = "s",
                .meaning = "duration of contact, from touch to separation",
                .value = at<&CaseResult::duration_s>,
                .shown_unit = "us",
                .shown_per_unit = 1e6},
    ResultField{.name = "fn_peak_N",
                .unit = "N",
                .meaning = "largest normal force; forces act on the tip, the normal one upwards, "
                           "never negative",
                .value = at<&CaseResult::fn_peak_N>},
    ResultField{.name = "ft_peak_N",
                .unit = "N",
                .meaning = "largest magnitude of the tangential force",
                .value = at<&CaseResult::ft_peak_N>},
    ResultField{.name = "fn_peaks_N",
                .unit = "N",
                .meaning = "every peak of the normal force, ripples included, in order of time; "
                           "the second one that is no ripple is major_peak_2_N",
                .value = ListPart{&kPeaks, "fn_N"}},
    ResultField{.name = "ft_peaks_N",
                .unit = "N",
                .meaning = "every peak of the magnitude of the tangential force, in order of time",
                .value = ListPart{&kFtPeaks, "ft_N"}},
    ResultField{.name = "major_peaks_N",
                .unit = "N",
                .meaning = "the peaks of the normal force left when ripples are merged",
                .value = ListPart{&kPeaks, "fn_N", "major"}},
    major_peak_force<1>("major_peak_1_N", "first peak of the normal force, ripples merged"),
    major_peak_force<2>("major_peak_2_N",
                        "second peak of the normal force, ripples merged; NULL: there is none"),
    major_peak_force<3>("major_peak_3_N",
                        "third peak of the normal force, ripples merged; NULL: there is none"),
    major_peak_instant<1>("major_peak_1_t_s", "when major_peak_1_N is reached, from touch"),
    major_peak_instant<2>("major_peak_2_t_s", "when major_peak_2_N is reached, from touch"),
    major_peak_instant<3>("major_peak_3_t_s", "when major_peak_3_N is reached, from touch"),
    ResultField{.name = "impulse_n_Ns",
                .unit = "N s",
                .meaning = "impulse of the normal force, upwards",
                .value = at<&CaseResult::impulse_n_Ns>},
    ResultField{.name = "impulse_t_Ns",
                .unit = "N s",
                .meaning = "impulse of the tangential force, along x; positive: away from the pin",
                .value = at<&CaseResult::impulse_t_Ns>},
    ResultField{.name = "slide_m",
                .unit = "m",
                .meaning = "length of the path of the contact particle P along the ground, there "
                           "and back both counted",
                .value = at<&CaseResult::slide_m>,
                .shown_unit = "mm",
                .shown_per_unit = 1e3},
    ResultField{.name = "vt_out_m_s",
                .unit = "m/s",
                .meaning = "tangential velocity of the tip at separation, along x; negative: "
                           "towards the pin",
                .value = at<&CaseResult::vt_out_m_s>},
    ResultField{
        .name = "vn_out_m_s",
        .unit = "m/s",
        .meaning = "normal velocity of the tip at separation, upwards; positive: off the ground",
        .value = at<&CaseResult::vn_out_m_s>},
    ResultField{.name = "mode",
                .meaning = "order of states: S stick, s slip; C compression, R restitution",
                .value = at<&CaseResult::mode>},
    ResultField{.name = "major_mode",
                .meaning = "the same with ripples merged",
                .value = at<&CaseResult::major_mode>},
    ResultField{.name = "margin",
                .meaning = "how far the contact kept from another order of events, from 0; near 0 "
                           "the mode is not to be trusted",
                .value = at<&CaseResult::margin>},
    ResultField{.name = "margin_event",
                .meaning = "the event that came so near to happening, or to not happening",
                .value = at<&CaseResult::margin_event>},
    ResultField{.name = "stick_total_s",
                .unit = "s",
                .meaning = "total time in stick",
                .value = at<&CaseResult::stick_total_s>,
                .shown_unit = "us",
                .shown_per_unit = 1e6},
    ResultField{.name = "stick_intervals_s",
                .unit = "s",
                .meaning = "spans in which P does not move: [from, to], counted from touch",
                .value = ListPart{&kStickIntervals}},
    ResultField{.name = kPhases.column,
                .unit = kPhases.unit,
                .meaning = kPhases.meaning,
                .value = ListPart{&kPhases}},
    ResultField{.name = kReactionPeaks.column,
                .unit = kReactionPeaks.unit,
                .meaning = kReactionPeaks.meaning,
                .value = ListPart{&kReactionPeaks}},
    ResultField{.name = "kinetic_in_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "kinetic energy of the whole finger at touch",
                .value = at<kEnergyOf, &ContactEnergy::kinetic_in_J>},
    ResultField{.name = "friction_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "energy lost to friction at P; what is lost is positive",
                .value = at<kEnergyOf, &ContactEnergy::friction_J>},
    ResultField{.name = "restitution_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "energy lost in the normal contact element; what is lost is positive",
                .value = at<kEnergyOf, &ContactEnergy::restitution_J>},
    ResultField{.name = "kinetic_change_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "kinetic energy at separation less that at touch",
                .value = at<kEnergyOf, &ContactEnergy::kinetic_change_J>},
    ResultField{.name = "strain_change_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "strain energy of the links at separation less that at touch",
                .value = at<kEnergyOf, &ContactEnergy::strain_change_J>},
    ResultField{.name = "gravity_change_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "potential energy at separation less that at touch",
                .value = at<kEnergyOf, &ContactEnergy::gravity_change_J>},
    ResultField{.name = "exchanged_J",
                .group = kEnergy,
                .unit = "J",
                .meaning = "work that the contact forces exchanged with the finger, to and fro "
                           "both counted",
                .value = at<kEnergyOf, &ContactEnergy::exchanged_J>},
    ResultField{.name = "closure",
                .group = kEnergy,
                .meaning = "what does not add up in the energy balance, relative to exchanged_J; "
                           "never negative",
                .value = at<kEnergyOf, &ContactEnergy::closure>},
    ResultField{.name = "mode_same",
                .group = kErrors,
                .column = "mode_same",
                .meaning =
                    "1: half the mesh and twice the step give the same mode, ripples merged; 0: "
                    "another. This and the errors below are there only when they were asked for",
                .value = at<kErrorsOf, &ErrorEstimate::mode_same>},
    ResultField{.name = "fn_peak",
                .group = kErrors,
                .column = "fn_peak_error",
                .meaning = "estimated error of fn_peak_N, as a fraction of it",
                .value = at<kErrorsOf, &ErrorEstimate::fn_peak>},
    ResultField{.name = "ft_peak",
                .group = kErrors,
                .column = "ft_peak_error",
                .meaning = "estimated error of ft_peak_N, as a fraction of fn_peak_N",
                .value = at<kErrorsOf, &ErrorEstimate::ft_peak>},
    ResultField{.name = "duration",
                .group = kErrors,
                .column = "duration_error",
                .meaning = "estimated error of duration_s, as a fraction of it",
                .value = at<kErrorsOf, &ErrorEstimate::duration>},
    ResultField{.name = "stick_total",
                .group = kErrors,
                .column = "stick_total_error",
                .meaning = "estimated error of stick_total_s, as a fraction of duration_s",
                .value = at<kErrorsOf, &ErrorEstimate::stick_total>},
    ResultField{
        .name = "slide",
        .group = kErrors,
        .column = "slide_error",
        .meaning = "estimated error of slide_m, as a fraction of speed at touch times duration_s",
        .value = at<kErrorsOf, &ErrorEstimate::slide>},
    ResultField{.name = "impulse_n",
                .group = kErrors,
                .column = "impulse_n_error",
                .meaning = "estimated error of impulse_n_Ns, as a fraction of it",
                .value = at<kErrorsOf, &ErrorEstimate::impulse_n>},
    ResultField{.name = "impulse_t",
                .group = kErrors,
                .column = "impulse_t_error",
                .meaning = "estimated error of impulse_t_Ns, as a fraction of impulse_n_Ns",
                .value = at<kErrorsOf, &ErrorEstimate::impulse_t>},
    ResultField{.name = "v_out",
                .group = kErrors,
                .column = "v_out_error",
                .meaning = "estimated error of the velocity at separation (vt_out_m_s and "
                           "vn_out_m_s as one vector), as a fraction of the speed at touch",
                .value = at<kErrorsOf, &ErrorEstimate::v_out>},
    ResultField{.name = "integrator",
                .group = kSolver,
                .meaning = "how the equations of motion are stepped: explicit or generalized-alpha",
                .value = at<kSolverOf, &SolverReport::integrator>,
                .sent_with = SentWith::kModel},
    ResultField{.name = "dt_s",
                .group = kSolver,
                .unit = "s",
                .meaning = "step in contact, in compression; restitution at low e steps shorter",
                .value = at<kSolverOf, &SolverReport::dt_s>,
                .shown_unit = "us",
                .shown_per_unit = 1e6},
    ResultField{.name = "steps",
                .group = kSolver,
                .meaning = "accepted steps in contact",
                .value = at<kSolverOf, &SolverReport::steps>},
    ResultField{.name = "wall_s",
                .group = kSolver,
                .unit = "s",
                .meaning = "wall time of the contact alone; not reproducible",
                .value = at<kSolverOf, &SolverReport::wall_s>,
                .shown_unit = "ms",
                .shown_per_unit = 1e3},
    ResultField{.name = "version",
                .group = kSolver,
                .column = "solver_version",
                .meaning = "version of the solver",
                .value = at<kSolverOf, &SolverReport::version>,
                .sent_with = SentWith::kWorker}};

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
