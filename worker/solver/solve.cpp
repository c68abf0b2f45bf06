#include "worker/solver/solve.h"

#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "worker/solver/falls.h"
#include "worker/solver/fast/lane_contacts.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/solve_contact.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {

/// What copies of a Finger share: the model, its steps in contact, and the fall, solved or not yet.
class Finger::Parts {
 public:
  /// Its fall is `fallen`, or comes from `falls`, or without both is solved here.
  Parts(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen,
        std::shared_ptr<FallCache> falls)
      : model_(validated(model)),
        falling_(fallen ? nullptr : std::make_shared<FallenChain>(model)),
        falls_(std::move(falls)),
        fall_{std::move(fallen), {}},
        steps_(prepared().chain(), model) {
    if (fall_.fallen) {
      if (!(fall_model(model) == fall_.fallen->model())) {
        throw std::invalid_argument("the fall is of another model");
      }
      std::call_once(fall_once_, [] {});
    }
  }

  const ModelParameters& model() const { return model_; }
  /// The chain, whether its fall is solved or not.
  const FallenChain& prepared() const { return falling_ ? *falling_ : *fall_.fallen; }
  const StepChoice& steps() const { return steps_; }

  /// Throws SolveError when the fall has no end, again and at once for every point: what one long
  /// computation has said need not be computed again.
  const std::shared_ptr<const FallenChain>& fallen() const {
    std::call_once(fall_once_, [this] {
      fall_ = falls_ ? falls_->fall(model_) : solve_falls({&falling_, 1}).front();
    });
    if (!fall_.fallen) {
      throw SolveError(fall_.error);
    }
    return fall_.fallen;
  }
  const Fall& fall() const { return fallen()->fall(); }

  /// Throws InputError for a value outside its range, a step that is too long, an H never reached.
  void check(const Point& point) const {
    validate_point(model_, point.H_m, point.mu, point.e_star);
    steps_.contact(point.e_star);
    if (point.H_m > fall().largest_drop_m()) {
      fall().state_at(point.H_m);
    }
  }
  ContactParameters contact_parameters(const Point& point) const {
    return {model_.k_N_m, model_.eta2, point.mu, point.e_star};
  }
  void sign(SolverReport& report) const {
    report.integrator = integrator_name(model_.integrator);
    report.version = solver_version();
  }
  CaseResult solve_by_motion(const Point& point, const Tracing& tracing) const {
    ChainState touch = fall().state_at(point.H_m);
    const double fall_time_s = touch.t_s;
    CaseResult result = solve_contact(*prepared().motion(), contact_parameters(point),
                                      steps_.contact(point.e_star), std::move(touch), tracing);
    result.H_m = point.H_m;
    result.fall_time_s = fall_time_s;
    sign(result.solver);
    return result;
  }

 private:
  static const ModelParameters& validated(const ModelParameters& model) {
    validate(model);
    return model;
  }

  ModelParameters model_;
  std::shared_ptr<FallenChain> falling_;  ///< none where the fall was given
  std::shared_ptr<FallCache> falls_;
  mutable std::once_flag fall_once_;
  mutable FallOutcome fall_;
  StepChoice steps_;
};

namespace {

/// Points of any fingers, from a source to a sink.
class Crowd {
 public:
  Crowd(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing)
      : source_(source), sink_(sink), tracing_(tracing) {}

  void solve() {
    while (fetch()) {
      if (is_for_lanes(*upcoming_)) {
        solve_in_lanes();
      } else {
        solve_by_motion(*std::exchange(upcoming_, std::nullopt));
      }
    }
  }

 private:
  struct Entry {
    FingerPoint point;
    double fall_time_s;
  };

  static bool is_for_lanes(const FingerPoint& point) {
    return point.finger.model().integrator == Integrator::kExplicit;
  }

  void solve_by_motion(const FingerPoint& point) {
    Outcome outcome{point.number, std::nullopt, {}};
    bool touches = false;
    try {
      point.finger.parts()->check(point.point);
      touches = true;
      outcome.result = point.finger.parts()->solve_by_motion(point.point, tracing_);
    } catch (const std::exception& error) {
      outcome.error =
          touches ? with_likely_cause(error.what(), point.finger.model()) : error.what();
    }
    sink_(std::move(outcome));
  }

  /// The points from upcoming_ on whose chains can share its lanes.
  void solve_in_lanes() {
    const auto first = upcoming_->finger.parts();  // keeps its chain
    const Chain& shape = first->prepared().chain();
    const auto take = [&]() -> std::optional<ContactCase> {
      while (fetch() && shares_lanes_of(shape)) {
        if (const auto next = begun(*std::exchange(upcoming_, std::nullopt))) {
          return next;
        }
      }
      return std::nullopt;
    };
    solve_contacts(
        shape, take, [this](ContactOutcome&& contact) { give(std::move(contact)); }, tracing_);
  }

  /// Makes the next point upcoming_; false when none follows.
  bool fetch() {
    if (!upcoming_ && !has_ended_) {
      upcoming_ = source_();
      has_ended_ = !upcoming_;
    }
    return upcoming_.has_value();
  }
  bool shares_lanes_of(const Chain& chain) const {
    return is_for_lanes(*upcoming_) &&
           have_one_shape(upcoming_->finger.parts()->prepared().chain().tables(), chain.tables());
  }

  std::optional<ContactCase> begun(FingerPoint&& point) {
    const Point& request = point.point;
    const auto& finger = point.finger.parts();
    try {
      validate_point(finger->model(), request.H_m, request.mu, request.e_star);
      const ContactSteps steps = finger->steps().contact(request.e_star);
      const ChainState& touch = touch_of(*finger, request.H_m);
      group_ += continues_group(point, steps) ? 0U : 1U;
      last_ = point;
      last_compression_s_ = steps.compression_s;
      under_way_.insert_or_assign(next_tag_, Entry{point, touch.t_s});
      return ContactCase{
          next_tag_++, group_, &finger->prepared().chain(), finger->contact_parameters(request),
          steps,       &touch};
    } catch (const std::exception& error) {
      sink_({point.number, std::nullopt, error.what()});
      return std::nullopt;
    }
  }

  /// The state at touch, found once for neighbours. Valid until the next call.
  const ChainState& touch_of(const Finger::Parts& finger, double H_m) {
    constexpr std::size_t kMostTouches = 16;
    if (fallen_ != finger.fallen() || touches_.size() >= kMostTouches) {
      fallen_ = finger.fallen();
      touches_.clear();
    }
    auto found = touches_.find(H_m);
    if (found == touches_.end()) {
      found = touches_.emplace(H_m, fallen_->fall().state_at(H_m)).first;
    }
    return found->second;
  }

  /// Whether the contact comes the same way as that begun last up to its first turn.
  bool continues_group(const FingerPoint& point, const ContactSteps& steps) const {
    return last_ && last_->finger.parts() == point.finger.parts() &&
           last_->point.H_m == point.point.H_m && last_->point.mu == point.point.mu &&
           last_compression_s_ == steps.compression_s;
  }

  void give(ContactOutcome&& contact) {
    const auto entry = under_way_.extract(contact.tag);
    const auto& [point, fall_time_s] = entry.mapped();
    if (contact.result) {
      contact.result->H_m = point.point.H_m;
      contact.result->fall_time_s = fall_time_s;
      point.finger.parts()->sign(contact.result->solver);
    } else {
      contact.error = with_likely_cause(std::move(contact.error), point.finger.model());
    }
    sink_({point.number, std::move(contact.result), std::move(contact.error)});
  }

  const FingerPoints& source_;
  const TakeOutcome& sink_;
  const Tracing& tracing_;
  std::shared_ptr<const FallenChain> fallen_;  ///< of the touches; keeps its address its own
  std::map<double, ChainState> touches_;       ///< by H
  std::optional<FingerPoint> upcoming_;        ///< taken from the source, not begun
  bool has_ended_ = false;
  std::optional<FingerPoint> last_;  ///< begun last in lanes
  double last_compression_s_ = 0.0;  ///< its step
  std::map<std::uint64_t, Entry> under_way_;
  std::uint64_t next_tag_ = 0;
  std::uint64_t group_ = 0;
};

}  // namespace

std::string instruction_set() {
  return std::string(runnable_lane_kernels().front().name);
}

void solve_points(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing) {
  Crowd(source, sink, tracing).solve();
}

std::vector<Outcome> solve_points(const Finger& finger, std::span<const Point> points) {
  std::vector<Outcome> outcomes(points.size());
  std::size_t next = 0;
  solve_points(
      [&]() -> std::optional<FingerPoint> {
        if (next == points.size()) {
          return std::nullopt;
        }
        const std::size_t number = next++;
        return FingerPoint{finger, number, points[number]};
      },
      [&](Outcome&& outcome) { outcomes[outcome.number] = std::move(outcome); });
  return outcomes;
}

Finger::Finger(const ModelParameters& model, std::shared_ptr<FallCache> falls)
    : parts_(std::make_shared<const Parts>(model, nullptr, std::move(falls))) {}
Finger::Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen)
    : parts_(std::make_shared<const Parts>(model, std::move(fallen), nullptr)) {}

const ModelParameters& Finger::model() const {
  return parts_->model();
}
double Finger::largest_drop_m() const {
  return parts_->fall().largest_drop_m();
}
double Finger::drop_so_far_m() const {
  return parts_->prepared().fall_progress();
}

CaseResult Finger::solve(double H_m, double mu, double e_star, const Tracing& tracing) const {
  const Point asked{H_m, mu, e_star};
  parts_->check(asked);
  if (tracing.sink && tracing.with_fall) {
    trace_fall(*parts_->prepared().motion(), parts_->fall(), H_m, tracing);
  }
  std::optional<FingerPoint> point = FingerPoint{*this, 0, asked};
  Outcome outcome{};
  solve_points([&point] { return std::exchange(point, std::nullopt); },
               [&outcome](Outcome&& o) { outcome = std::move(o); }, tracing);
  if (!outcome.result) {
    throw SolveError(outcome.error);
  }
  return std::move(*outcome.result);
}

}  // namespace oblique::solver
