// Work and precision of the fall: CPU of a fall against the errors that it leaves in what a contact
// after it gives, for explicit steps and for collocation with several numbers of stages.
//   oblique-fall-precision [ELEMENTS_PER_LINK ...]      4 8 16 by default
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/worker/solver/fall/precision/stage_kernels.h"
#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/fall/collocation_fall.h"
#include "worker/solver/motion/pefrl.h"
#include "worker/solver/step_choice.h"

namespace oblique::bench {
namespace {

using namespace solver;

constexpr double kDrops_m[]{0.5, 1.0, 1.1};
constexpr double kFrictions[]{0.4, 1.2};
/// Accuracy that the solution is asked for to which all others are compared.
constexpr double kReference = 3e-7;

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class Precision {
 public:
  explicit Precision(int elements_per_link)
      : model_(with(elements_per_link)),
        chain_(model_),
        motion_(chain_),
        steps_(chain_, model_),
        reference_(by_collocation(runnable_collocation_kernels().front(), kReference, 1)) {
    for (const double H_m : kDrops_m) {
      for (const double mu : kFrictions) {
        contacts_[{H_m, mu}] = contact(reference_.state_at(H_m), mu);
      }
    }
  }

  void compare_all() const {
    std::printf("n = %d\n%-10s %9s %9s %8s %8s %8s %8s %8s %8s\n", model_.elements_per_link, "",
                "asked", "CPU [ms]", "t [s]", "V [m/s]", "F_n max", "peaks", "duration",
                "out [m/s]");
    const double limit_s = Pefrl::stability_limit() / chain_.highest_frequency_rad_s(0.0);
    for (const double part : {0.9, 0.5}) {
      char asked[32];
      std::snprintf(asked, sizeof asked, "%.2f us", 1e6 * part * limit_s);
      report("PEFRL", asked, 1, [&] { return Fall(chain_, part * limit_s); });
    }
    for (const CollocationKernel& kernel : stage_kernels()) {
      for (const double accuracy : {3e-5, 1e-5, 3e-6}) {
        char asked[32];
        std::snprintf(asked, sizeof asked, "%.0e", accuracy);
        report(kernel.name.data(), asked, kernel.lanes,
               [&] { return by_collocation(kernel, accuracy, kernel.lanes); });
      }
    }
  }

 private:
  static ModelParameters with(int elements_per_link) {
    ModelParameters model = preset("paper");
    model.elements_per_link = elements_per_link;
    return model;
  }

  Fall by_collocation(const CollocationKernel& kernel, double accuracy, std::size_t beside) const {
    const std::vector<FallRequest> requests(beside, {&chain_, &model_, accuracy, nullptr});
    const std::vector<FallSolution> solutions = solve_by_collocation(requests, kernel);
    if (!solutions.front().path) {
      std::fprintf(stderr, "%s\n", solutions.front().error.c_str());
      std::exit(1);
    }
    return Fall(solutions.front().path);
  }

  CaseResult contact(ChainState touch, double mu) const {
    return solve_contact(motion_, {model_.k_N_m, model_.eta2, mu, 1.0}, steps_.contact(1.0),
                         std::move(touch), {});
  }

  /// One row: errors are the largest over all drops and frictions.
  void report(const char* method, const char* asked, std::size_t falls,
              const std::function<Fall()>& solve) const {
    const double start_s = cpu_s();
    const Fall fall = solve();
    const double each_s = (cpu_s() - start_s) / static_cast<double>(falls);
    double t_s = 0.0;
    double v_m_s = 0.0;
    double largest = 0.0;
    double peaks = 0.0;
    double duration = 0.0;
    double out_m_s = 0.0;
    const auto keep = [](double& worst, double error) { worst = std::max(worst, std::abs(error)); };
    for (const auto& [point, exact] : contacts_) {
      const ChainState touch = fall.state_at(point.first);
      const ChainState exact_touch = reference_.state_at(point.first);
      const TipState a = chain_.tip(touch);
      const TipState b = chain_.tip(exact_touch);
      keep(t_s, touch.t_s - exact_touch.t_s);
      keep(v_m_s, std::hypot(a.vx_m_s - b.vx_m_s, a.vy_m_s - b.vy_m_s));
      const CaseResult result = contact(touch, point.second);
      keep(largest, result.fn_peak_N / exact.fn_peak_N - 1.0);
      keep(duration, result.duration_s / exact.duration_s - 1.0);
      keep(out_m_s,
           std::hypot(result.vt_out_m_s - exact.vt_out_m_s, result.vn_out_m_s - exact.vn_out_m_s));
      for (std::size_t i = 0; i < exact.peaks.size(); ++i) {
        keep(peaks, result.peaks.size() == exact.peaks.size()
                        ? result.peaks[i].fn_N / exact.peaks[i].fn_N - 1.0
                        : 1.0);
      }
    }
    std::printf("%-10s %9s %9.1f %8.0e %8.0e %8.0e %8.0e %8.0e %8.0e\n", method, asked,
                1e3 * each_s, t_s, v_m_s, largest, peaks, duration, out_m_s);
    std::fflush(stdout);
  }

  ModelParameters model_;
  Chain chain_;
  ExplicitMotion motion_;
  StepChoice steps_;
  Fall reference_;
  std::map<std::pair<double, double>, CaseResult> contacts_;
};

}  // namespace
}  // namespace oblique::bench

int main(int count, char** arguments) {
  std::vector<int> meshes;
  for (int i = 1; i < count; ++i) {
    meshes.push_back(std::atoi(arguments[i]));
  }
  if (meshes.empty()) {
    meshes = {4, 8, 16};
  }
  for (const int elements_per_link : meshes) {
    oblique::bench::Precision(elements_per_link).compare_all();
  }
  return 0;
}
