#include "worker/solver/solve.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <sstream>

#include "worker/solver/chain.h"
#include "worker/solver/contact.h"
#include "worker/solver/fall.h"
#include "worker/solver/pefrl.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

/// A balance that misses this much of the exchanged work means the step resolves nothing.
constexpr double kWorstClosure = 1e-2;

struct Energies {
  double kinetic_J;
  double strain_J;
  double gravity_J;
};

Energies energies(const Chain& chain, const ChainState& state) {
  return {chain.kinetic_energy_J(state.v), chain.strain_energy_J(state.q),
          chain.gravity_energy_J(state.q)};
}

void balance(const Energies& in, const Energies& out, const ContactRecord& record,
             CaseResult& result) {
  ContactEnergy& energy = result.energy;
  energy.kinetic_in_J = in.kinetic_J;
  energy.kinetic_change_J = out.kinetic_J - in.kinetic_J;
  energy.strain_change_J = out.strain_J - in.strain_J;
  energy.gravity_change_J = out.gravity_J - in.gravity_J;
  const double missing_J = energy.kinetic_change_J + energy.strain_change_J +
                           energy.gravity_change_J - record.work_n_J() - record.work_t_J();
  energy.closure = std::abs(missing_J) / energy.exchanged_J;
  if (!(energy.closure < kWorstClosure)) {
    std::ostringstream message;
    message << "the energy balance of the contact misses " << energy.closure
            << " of the exchanged work, more than " << kWorstClosure << ": dt is too long";
    throw SolveError(message.str());
  }
}

TraceRow trace_row(const Contact& contact, double touch_y_m) {
  const ContactLaw& law = contact.law();
  const TipState& tip = contact.tip();
  TraceRow row{};
  row.t_s = contact.time_s();
  row.fn_N = law.fn_N(tip);
  row.ft_N = law.ft_N(tip);
  row.uy_m = tip.y_m - touch_y_m;
  row.ux_m = law.ux_m(tip);
  row.xP_m = tip.x_m - row.ux_m;
  row.vP_m_s = law.is_stick() ? 0.0 : law.slip_velocity_m_s(tip);
  row.x_m = tip.x_m;
  row.y_m = tip.y_m;
  row.vt_m_s = tip.vx_m_s;
  row.vn_m_s = tip.vy_m_s;
  row.state = {law.is_stick() ? 'S' : 's', law.is_compression() ? 'C' : 'R'};
  return row;
}

}  // namespace

struct Finger::Parts {
  explicit Parts(ModelParameters parameters)
      : model(std::move(parameters)), chain(model), steps(chain, model) {}

  const Fall& solved_fall() const {
    std::call_once(fall_once, [this] { fall.emplace(chain, steps.fall_s()); });
    return *fall;
  }

  ModelParameters model;
  Chain chain;
  StepChoice steps;
  mutable std::once_flag fall_once;
  mutable std::optional<Fall> fall;
};

std::string solver_version() { return OBLIQUE_SOLVER_VERSION; }
std::string instruction_set() { return "generic"; }

Finger::Finger(ModelParameters model) : parts_(std::make_unique<Parts>(std::move(model))) {}
Finger::~Finger() = default;
Finger::Finger(Finger&&) noexcept = default;
Finger& Finger::operator=(Finger&&) noexcept = default;

const ModelParameters& Finger::model() const { return parts_->model; }
double Finger::largest_drop_m() const { return parts_->solved_fall().largest_drop_m(); }

CaseResult Finger::solve(double H_m, double mu, double e_star, const TraceSink& trace) const {
  validate_point(parts_->model, H_m, mu, e_star);
  const Chain& chain = parts_->chain;
  const ContactSteps steps = parts_->steps.contact(e_star);
  ChainState accepted = parts_->solved_fall().state_at(H_m);
  const auto started = std::chrono::steady_clock::now();
  const TipState touch = chain.tip(accepted);
  const Energies energies_in = energies(chain, accepted);

  CaseResult result{};
  result.H_m = H_m;
  result.mu = mu;
  result.e_star = e_star;
  result.fall_time_s = accepted.t_s;
  result.impact_x_m = touch.x_m;
  result.vt_in_m_s = touch.vx_m_s;
  result.vn_in_m_s = touch.vy_m_s;

  Contact contact({parts_->model.k_N_m, parts_->model.eta2, mu, e_star}, touch, steps);
  ChainState trial = accepted;
  Coordinates scratch(accepted.q.size());
  if (trace) {
    trace(trace_row(contact, touch.y_m));
  }
  while (!contact.finished()) {
    trial.q = accepted.q;
    trial.v = accepted.v;
    const auto integrals = pefrl_step(chain, contact.force(), contact.trial_step_s(),
                                      trial.q.data(), trial.v.data(), scratch.data());
    if (contact.judge(chain.tip(trial), integrals)) {
      std::swap(accepted, trial);
      if (trace) {
        trace(trace_row(contact, touch.y_m));
      }
    }
  }

  const TipState out = chain.tip(accepted);
  result.vt_out_m_s = out.vx_m_s;
  result.vn_out_m_s = out.vy_m_s;
  contact.record().write_to(result);
  balance(energies_in, energies(chain, accepted), contact.record(), result);
  result.solver.integrator = integrator_name(parts_->model.integrator);
  result.solver.dt_s = steps.compression_s;
  result.solver.steps = contact.steps();
  result.solver.version = solver_version();
  result.solver.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace oblique::solver
