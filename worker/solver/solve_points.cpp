#include "worker/solver/solve_points.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "worker/solver/chain/lane_chains.h"

#include "worker/solver/lanes/lane_batch.h"
#include "worker/solver/model/usual_ranges.h"
#include "worker/solver/solve.h"

namespace oblique::solver {
namespace {

using Source = std::function<std::optional<FingerPoint>()>;
using Sink = std::function<void(PointOutcome&&)>;

/// States at touch and steps for points that come in order: neighbours share a fall and H, and
/// cycle through the same e*.
class TouchCache {
 public:
  /// Valid until the next call.
  const ChainState& touch(const Finger::Parts& finger, double H_m) {
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

  ContactSteps steps(const std::shared_ptr<const Finger::Parts>& finger, double e_star) {
    if (finger_ != finger || steps_.size() >= kMostSteps) {
      finger_ = finger;
      steps_.clear();
    }
    auto found = steps_.find(e_star);
    if (found == steps_.end()) {
      found = steps_.emplace(e_star, finger->steps().contact(e_star)).first;
    }
    return found->second;
  }

 private:
  static constexpr std::size_t kMostTouches = 16;
  static constexpr std::size_t kMostSteps = 4096;

  std::shared_ptr<const FallenChain> fallen_;  // also keeps its address from being another's
  std::map<double, ChainState> touches_;
  std::shared_ptr<const Finger::Parts> finger_;
  std::map<double, ContactSteps> steps_;
};

/// Points of any fingers, from a source to a sink.
class Crowd {
 public:
  Crowd(const Source& source, const Sink& sink, const Tracing& tracing)
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
    PointOutcome outcome{point.point.number, std::nullopt, {}};
    bool touches = false;
    try {
      const auto& [number, H_m, mu, e_star] = point.point;
      point.finger.parts()->check(H_m, mu, e_star);
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
    const auto prepared = upcoming_->finger.parts()->prepared();
    LaneBatch batch(prepared->chain(), runnable_lane_kernels().front());
    const auto take = [&]() -> std::optional<ContactCase> {
      while (fetch() && shares_lanes_of(prepared->chain())) {
        if (const auto next = begun(*std::exchange(upcoming_, std::nullopt))) {
          return next;
        }
      }
      return std::nullopt;
    };
    batch.solve(
        take, [this](ContactOutcome&& contact) { give(std::move(contact)); }, tracing_);
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
           have_one_shape(upcoming_->finger.parts()->prepared()->chain().tables(), chain.tables());
  }

  std::optional<ContactCase> begun(FingerPoint&& point) {
    const PointRequest& request = point.point;
    const auto& finger = point.finger.parts();
    try {
      validate_point(finger->model(), request.H_m, request.mu, request.e_star);
      const ContactSteps steps = touches_.steps(finger, request.e_star);
      const ChainState& touch = touches_.touch(*finger, request.H_m);
      group_ += continues_group(point, steps) ? 0U : 1U;
      last_ = point;
      last_compression_s_ = steps.compression_s;
      under_way_.insert_or_assign(next_tag_, Entry{point, touch.t_s});
      return ContactCase{next_tag_++,
                         group_,
                         &finger->prepared()->chain(),
                         finger->contact_parameters(request.mu, request.e_star),
                         steps,
                         &touch};
    } catch (const std::exception& error) {
      sink_({request.number, std::nullopt, error.what()});
      return std::nullopt;
    }
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
    sink_({point.point.number, std::move(contact.result), std::move(contact.error)});
  }

  const Source& source_;
  const Sink& sink_;
  const Tracing& tracing_;
  TouchCache touches_;
  std::optional<FingerPoint> upcoming_;  ///< taken from the source, not begun
  bool has_ended_ = false;
  std::optional<FingerPoint> last_;  ///< begun last in lanes
  double last_compression_s_ = 0.0;  ///< its step
  std::map<std::uint64_t, Entry> under_way_;
  std::uint64_t next_tag_ = 0;
  std::uint64_t group_ = 0;
};

}  // namespace

void solve_points(const Source& source, const Sink& sink) {
  solve_points(source, sink, Tracing{});
}

void solve_points(const Source& source, const Sink& sink, const Tracing& tracing) {
  Crowd(source, sink, tracing).solve();
}

}  // namespace oblique::solver
