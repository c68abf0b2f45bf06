#include "worker/solver/solve.h"

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "worker/solver/chain/chain.h"
#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/lanes/lane_batch.h"
#include "worker/solver/motion/fall.h"
#include "worker/solver/motion/generalized_alpha.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

std::shared_ptr<const Motion> make_motion(const ModelParameters& model, const Chain& chain) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    return std::make_shared<GeneralizedAlphaMotion>(model);
  }
  return std::make_shared<ExplicitMotion>(chain);
}

}  // namespace

struct Finger::Parts {
  explicit Parts(ModelParameters parameters)
      : model(std::move(parameters)),
        chain(model),
        steps(chain, model),
        motion(make_motion(model, chain)) {}

  /// Throws SolveError when the fall has no end, again and at once for every point: what one long
  /// computation has said need not be computed again.
  const Fall& solved_fall() const {
    std::call_once(fall_once, [this] {
      try {
        fall.emplace(motion, steps.fall_s(), longest_fall_s(chain));
      } catch (const SolveError& error) {
        fall_error = error.what();
      }
    });
    if (!fall) {
      throw SolveError(fall_error);
    }
    return *fall;
  }

  /// Throws InputError for a value outside its range, a step that is too long, an H never reached.
  void check(double H_m, double mu, double e_star) const {
    validate_point(model, H_m, mu, e_star);
    steps.contact(e_star);
    if (H_m > solved_fall().largest_drop_m()) {
      solved_fall().state_at(H_m);
    }
  }
  ContactParameters contact_parameters(double mu, double e_star) const {
    return {model.k_N_m, model.eta2, mu, e_star};
  }
  void sign(SolverReport& report) const {
    report.integrator = integrator_name(model.integrator);
    report.version = solver_version();
  }
  CaseResult solve_by_motion(const PointRequest& point, const Tracing& tracing) const {
    ChainState touch = solved_fall().state_at(point.H_m);
    const double fall_time_s = touch.t_s;
    CaseResult result = solve_contact(*motion, contact_parameters(point.mu, point.e_star),
                                      steps.contact(point.e_star), std::move(touch), tracing);
    result.H_m = point.H_m;
    result.fall_time_s = fall_time_s;
    sign(result.solver);
    return result;
  }

  ModelParameters model;
  Chain chain;
  StepChoice steps;
  std::shared_ptr<const Motion> motion;
  mutable std::once_flag fall_once;
  mutable std::optional<Fall> fall;
  mutable std::string fall_error;  ///< why there is no fall, once that is known
};

namespace {

/// States at touch and steps for points that come in order: neighbours share H and cycle through
/// the same e*.
class TouchCache {
 public:
  explicit TouchCache(const Finger::Parts& parts) : parts_(parts) {}

  const ChainState& at(double H_m) {
    if (!(H_m == H_m_)) {
      touch_ = parts_.solved_fall().state_at(H_m);
      H_m_ = H_m;
    }
    return touch_;
  }
  ContactSteps steps(double e_star) {
    if (steps_.size() >= kMostSteps) {
      steps_.clear();
    }
    auto found = steps_.find(e_star);
    if (found == steps_.end()) {
      found = steps_.emplace(e_star, parts_.steps.contact(e_star)).first;
    }
    return found->second;
  }

 private:
  static constexpr std::size_t kMostSteps = 4096;

  const Finger::Parts& parts_;
  double H_m_ = 0.0;  // no drop: the first at() finds its own
  ChainState touch_;
  std::map<double, ContactSteps> steps_;
};

}  // namespace

std::string instruction_set() {
  return std::string(runnable_lane_kernels().front().name);
}

Finger::Finger(ModelParameters model) : parts_(std::make_unique<Parts>(std::move(model))) {}
Finger::~Finger() = default;
Finger::Finger(Finger&&) noexcept = default;
Finger& Finger::operator=(Finger&&) noexcept = default;

const ModelParameters& Finger::model() const {
  return parts_->model;
}
double Finger::largest_drop_m() const {
  return parts_->solved_fall().largest_drop_m();
}

CaseResult Finger::solve(double H_m, double mu, double e_star) const {
  return solve(H_m, mu, e_star, Tracing{});
}

CaseResult Finger::solve(double H_m, double mu, double e_star, const Tracing& tracing) const {
  parts_->check(H_m, mu, e_star);
  if (parts_->model.integrator != Integrator::kExplicit) {
    return parts_->solve_by_motion({0, H_m, mu, e_star}, tracing);
  }
  std::optional<PointRequest> request = PointRequest{0, H_m, mu, e_star};
  PointOutcome outcome{};
  solve_in_lanes([&request] { return std::exchange(request, std::nullopt); },
                 [&outcome](PointOutcome&& o) { outcome = std::move(o); }, tracing);
  if (!outcome.result) {
    throw SolveError(outcome.error);
  }
  return std::move(*outcome.result);
}

void Finger::solve_points(const std::function<std::optional<PointRequest>()>& source,
                          const std::function<void(PointOutcome&&)>& sink) const {
  if (parts_->model.integrator == Integrator::kExplicit) {
    solve_in_lanes(source, sink, Tracing{});
    return;
  }
  while (const auto request = source()) {
    PointOutcome outcome{request->number, std::nullopt, {}};
    try {
      parts_->check(request->H_m, request->mu, request->e_star);
      outcome.result = parts_->solve_by_motion(*request, Tracing{});
    } catch (const std::exception& error) {
      outcome.error = error.what();
    }
    sink(std::move(outcome));
  }
}

void Finger::solve_in_lanes(const std::function<std::optional<PointRequest>()>& source,
                            const std::function<void(PointOutcome&&)>& sink,
                            const Tracing& tracing) const {
  struct Entry {
    PointRequest request;
    double fall_time_s;
  };
  std::map<std::uint64_t, Entry> under_way;
  TouchCache touches(*parts_);
  std::uint64_t next_tag = 0;
  std::uint64_t group = 0;
  std::optional<PointRequest> last;
  const auto take = [&]() -> std::optional<ContactCase> {
    while (const auto request = source()) {
      try {
        validate_point(parts_->model, request->H_m, request->mu, request->e_star);
        const ContactSteps steps = touches.steps(request->e_star);
        const ChainState& touch = touches.at(request->H_m);
        group += last && last->H_m == request->H_m && last->mu == request->mu ? 0U : 1U;
        last = *request;
        under_way[next_tag] = {*request, touch.t_s};
        return ContactCase{next_tag++, group,
                           parts_->contact_parameters(request->mu, request->e_star), steps, &touch};
      } catch (const std::exception& error) {
        sink({request->number, std::nullopt, error.what()});
      }
    }
    return std::nullopt;
  };
  const auto give = [&](ContactOutcome&& contact) {
    const Entry entry = under_way.at(contact.tag);
    under_way.erase(contact.tag);
    if (contact.result) {
      contact.result->H_m = entry.request.H_m;
      contact.result->fall_time_s = entry.fall_time_s;
      parts_->sign(contact.result->solver);
    }
    sink({entry.request.number, std::move(contact.result), std::move(contact.error)});
  };
  LaneBatch batch(parts_->chain, runnable_lane_kernels().front());
  batch.solve(take, give, tracing);
}

}  // namespace oblique::solver
