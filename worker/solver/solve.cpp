#include "worker/solver/solve.h"

#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/falls.h"
#include "worker/solver/lanes/lane_batch.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {

class Finger::Parts {
 public:
  explicit Parts(const ModelParameters& model)
      : model_(validated(model)),
        prepared_(std::make_shared<const PreparedChain>(model)),
        steps_(prepared_->chain(), model) {}
  Parts(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen)
      : model_(validated(model)),
        prepared_(fallen->prepared()),
        steps_(prepared_->chain(), model),
        fall_({std::move(fallen), {}}) {
    if (!(fall_model(model) == prepared_->model())) {
      throw std::invalid_argument("the fall is of another model");
    }
    std::call_once(fall_once_, [] {});
  }

  const ModelParameters& model() const { return model_; }
  const Chain& chain() const { return prepared_->chain(); }
  const StepChoice& steps() const { return steps_; }
  const FallProgress& fall_progress() const { return prepared_->fall_progress(); }

  /// Throws SolveError when the fall has no end, again and at once for every point: what one long
  /// computation has said need not be computed again.
  const Fall& solved_fall() const {
    std::call_once(fall_once_, [this] { fall_ = solve_falls({&prepared_, 1}).front(); });
    if (!fall_.fallen) {
      throw SolveError(fall_.error);
    }
    return fall_.fallen->fall();
  }

  /// Throws InputError for a value outside its range, a step that is too long, an H never reached.
  void check(double H_m, double mu, double e_star) const {
    validate_point(model_, H_m, mu, e_star);
    steps_.contact(e_star);
    if (H_m > solved_fall().largest_drop_m()) {
      solved_fall().state_at(H_m);
    }
  }
  ContactParameters contact_parameters(double mu, double e_star) const {
    return {model_.k_N_m, model_.eta2, mu, e_star};
  }
  void sign(SolverReport& report) const {
    report.integrator = integrator_name(model_.integrator);
    report.version = solver_version();
  }
  CaseResult solve_by_motion(const PointRequest& point, const Tracing& tracing) const {
    ChainState touch = solved_fall().state_at(point.H_m);
    const double fall_time_s = touch.t_s;
    CaseResult result =
        solve_contact(prepared_->motion(), contact_parameters(point.mu, point.e_star),
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
  std::shared_ptr<const PreparedChain> prepared_;
  StepChoice steps_;
  mutable std::once_flag fall_once_;
  mutable FallOutcome fall_;
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
      found = steps_.emplace(e_star, parts_.steps().contact(e_star)).first;
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

Finger::Finger(const ModelParameters& model) : parts_(std::make_shared<const Parts>(model)) {}
Finger::Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen)
    : parts_(std::make_shared<const Parts>(model, std::move(fallen))) {}

const ModelParameters& Finger::model() const {
  return parts_->model();
}
double Finger::largest_drop_m() const {
  return parts_->solved_fall().largest_drop_m();
}
const FallProgress& Finger::fall_progress() const {
  return parts_->fall_progress();
}

CaseResult Finger::solve(double H_m, double mu, double e_star) const {
  return solve(H_m, mu, e_star, Tracing{});
}

CaseResult Finger::solve(double H_m, double mu, double e_star, const Tracing& tracing) const {
  parts_->check(H_m, mu, e_star);
  if (parts_->model().integrator != Integrator::kExplicit) {
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
  if (parts_->model().integrator == Integrator::kExplicit) {
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
        validate_point(parts_->model(), request->H_m, request->mu, request->e_star);
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
  LaneBatch batch(parts_->chain(), runnable_lane_kernels().front());
  batch.solve(take, give, tracing);
}

}  // namespace oblique::solver
