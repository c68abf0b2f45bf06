#include "worker/solver/solve.h"

#include <exception>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "worker/solver/falls.h"
#include "worker/solver/fast/lane_contacts.h"
#include "worker/solver/reference/solve_contact.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {

/// The data that copies of a Finger share: the model, its steps in contact, and the fall.
class Finger::Parts {
 public:
  /// Uses the fall `fallen`, or one from `falls`, or solves it if both are empty.
  Parts(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen,
        std::shared_ptr<FallCache> falls)
      : model_(validated(model)),
        falling_(fallen ? nullptr : std::make_shared<FallenChain>(model)),
        falls_(std::move(falls)),
        fall_{std::move(fallen), {}},
        steps_(prepared().chain(), model) {
    if (fall_.fallen && !(fall_model(model) == fall_.fallen->model())) {
      throw std::invalid_argument("the fall is of another model");
    }
  }

  const ModelParameters& model() const { return model_; }
  /// The chain; its fall may not be solved yet.
  const FallenChain& prepared() const { return falling_ ? *falling_ : *fall_.fallen; }

  /// Solves the fall at the first call. Throws SolveError when it has no answer.
  const std::shared_ptr<const FallenChain>& fallen() const {
    std::call_once(fall_once_, [this] {
      if (!fall_.fallen) {
        fall_ = falls_ ? falls_->fall(model_) : solve_falls({&falling_, 1}).front();
      }
    });
    if (!fall_.fallen) {
      throw SolveError(fall_.error);
    }
    return fall_.fallen;
  }
  const Fall& fall() const { return fallen()->fall(); }

  /// Throws InputError for a value outside its range and for a step that is too long.
  ContactSteps steps_for(const Point& point) const {
    validate_point(model_, point.H_m, point.mu, point.e_star);
    return steps_.contact(point.e_star);
  }
  ContactParameters contact_parameters(const Point& point) const {
    return {model_.k_N_m, model_.eta2, point.mu, point.e_star};
  }

 private:
  static const ModelParameters& validated(const ModelParameters& model) {
    validate(model);
    return model;
  }

  ModelParameters model_;
  std::shared_ptr<FallenChain> falling_;  ///< empty if the constructor received a solved fall
  std::shared_ptr<FallCache> falls_;
  mutable std::once_flag fall_once_;
  mutable FallOutcome fall_;
  StepChoice steps_;
};

namespace {

/// Solves the points of `source`, whose fingers may differ. Passes the outcomes to `sink`.
class PointSolver {
 public:
  PointSolver(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing)
      : source_(source), sink_(sink), tracing_(tracing) {}

  void solve() {
    while (fetch()) {
      is_for_lanes(*upcoming_) ? solve_in_lanes() : solve_by_motion();
    }
  }

 private:
  struct Begun {
    FingerPoint point;
    double fall_time_s;
  };

  static bool is_for_lanes(const FingerPoint& point) {
    return point.finger.model().integrator == Integrator::kExplicit;
  }

  /// Sets upcoming_ to the next point; false at the end.
  bool fetch() {
    if (!upcoming_ && !has_ended_) {
      upcoming_ = source_();
      has_ended_ = !upcoming_;
    }
    return upcoming_.has_value();
  }

  /// Solves one point, by any integrator.
  void solve_by_motion() {
    const std::optional<ContactCase> next = begin(*std::exchange(upcoming_, std::nullopt));
    if (!next) {
      return;
    }
    Outcome contact{next->number, std::nullopt, {}};
    try {
      const Motion& motion = *last_->finger.parts()->prepared().motion();
      contact.result = solve_contact(motion, next->parameters, next->steps, *next->touch, tracing_);
    } catch (const std::exception& error) {
      contact.error = error.what();
    }
    pass_on(std::move(contact));
  }

  /// Solves upcoming_ and the points after it whose chains can share lanes with it.
  void solve_in_lanes() {
    const auto first = upcoming_->finger.parts();  // owns the chain
    const Chain& shape = first->prepared().chain();
    const auto next = [&]() -> std::optional<ContactCase> {
      while (fetch() && shares_lanes_of(shape)) {
        if (const auto begun = begin(*std::exchange(upcoming_, std::nullopt))) {
          return begun;
        }
      }
      return std::nullopt;
    };
    solve_contacts(
        shape, next, [this](Outcome&& contact) { pass_on(std::move(contact)); }, tracing_);
  }

  bool shares_lanes_of(const Chain& chain) const {
    return is_for_lanes(*upcoming_) &&
           have_one_shape(upcoming_->finger.parts()->prepared().chain().tables(), chain.tables());
  }

  /// Prepares a contact, whose state at touch is valid until the next call. If the point cannot be
  /// solved, passes its error to the sink and returns nothing.
  std::optional<ContactCase> begin(FingerPoint&& point) {
    const Finger::Parts& finger = *point.finger.parts();
    try {
      const ContactSteps steps = finger.steps_for(point.point);
      const ChainState& touch = touch_of(finger, point.point.H_m);
      group_ += continues_group(point, steps) ? 0U : 1U;
      last_ = point;
      last_compression_s_ = steps.compression_s;
      begun_.insert_or_assign(next_number_, Begun{point, touch.t_s});
      return ContactCase{next_number_++,
                         group_,
                         &finger.prepared().chain(),
                         finger.contact_parameters(point.point),
                         steps,
                         &touch};
    } catch (const std::exception& error) {
      sink_({point.number, std::nullopt, error.what()});
      return std::nullopt;
    }
  }

  /// The state at touch, cached for the points that follow.
  const ChainState& touch_of(const Finger::Parts& finger, double H_m) {
    constexpr std::size_t kMaxTouches = 16;
    if (fallen_ != finger.fallen() || touches_.size() >= kMaxTouches) {
      fallen_ = finger.fallen();
      touches_.clear();
    }
    auto found = touches_.find(H_m);
    if (found == touches_.end()) {
      found = touches_.emplace(H_m, fallen_->fall().state_at(H_m)).first;
    }
    return found->second;
  }

  /// Whether the contacts of this point and of the point begun last are equal until their first
  /// compression ends.
  bool continues_group(const FingerPoint& point, const ContactSteps& steps) const {
    return last_ && last_->finger.parts() == point.finger.parts() &&
           last_->point.H_m == point.point.H_m && last_->point.mu == point.point.mu &&
           last_compression_s_ == steps.compression_s;
  }

  void pass_on(Outcome&& contact) {
    const auto entry = begun_.extract(contact.number);
    const auto& [point, fall_time_s] = entry.mapped();
    const ModelParameters& model = point.finger.model();
    if (contact.result) {
      contact.result->H_m = point.point.H_m;
      contact.result->fall_time_s = fall_time_s;
      contact.result->solver.integrator = integrator_name(model.integrator);
      contact.result->solver.version = solver_version();
    } else {
      contact.error = with_likely_cause(std::move(contact.error), model);
    }
    sink_({point.number, std::move(contact.result), std::move(contact.error)});
  }

  const FingerPoints& source_;
  const TakeOutcome& sink_;
  const Tracing& tracing_;
  std::shared_ptr<const FallenChain> fallen_;  ///< fall of the states in touches_
  std::map<double, ChainState> touches_;       ///< by H
  std::optional<FingerPoint> upcoming_;        ///< next point of the source
  bool has_ended_ = false;
  std::optional<FingerPoint> last_;  ///< the point begun last
  double last_compression_s_ = 0.0;  ///< step in compression of the point begun last
  std::map<std::uint64_t, Begun> begun_;
  std::uint64_t next_number_ = 0;
  std::uint64_t group_ = 0;
};

}  // namespace

std::string instruction_set() {
  return std::string(runnable_lane_kernels().front().name);
}

void solve_points(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing) {
  PointSolver(source, sink, tracing).solve();
}

std::vector<Outcome> solve_points(const Finger& finger, std::span<const Point> points,
                                  const Tracing& tracing) {
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
      [&](Outcome&& outcome) { outcomes[outcome.number] = std::move(outcome); }, tracing);
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
  const Point point{H_m, mu, e_star};
  parts_->steps_for(point);
  if (H_m > largest_drop_m()) {
    parts_->fall().state_at(H_m);  // throws InputError
  }
  if (tracing.sink && tracing.with_fall) {
    trace_fall(*parts_->prepared().motion(), parts_->fall(), H_m, tracing);
  }
  Outcome outcome = std::move(solve_points(*this, {&point, 1}, tracing).front());
  if (!outcome.result) {
    throw SolveError(outcome.error);
  }
  return std::move(*outcome.result);
}

}  // namespace oblique::solver
