#include "worker/solver/solve.h"

namespace oblique::solver {

struct Finger::Parts {
  ModelParameters model;
};

std::string solver_version() { return OBLIQUE_SOLVER_VERSION; }
std::string instruction_set() { return "generic"; }
Finger::Finger(ModelParameters model) : parts_(new Parts{std::move(model)}) { validate(parts_->model); }
Finger::~Finger() = default;
Finger::Finger(Finger&&) noexcept = default;
Finger& Finger::operator=(Finger&&) noexcept = default;
const ModelParameters& Finger::model() const { return parts_->model; }
double Finger::largest_drop_m() const { throw SolveError("not solved yet"); }
CaseResult Finger::solve(double, double, double, const TraceSink&) const { throw SolveError("not solved yet"); }

}  // namespace oblique::solver
