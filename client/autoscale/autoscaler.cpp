#include "client/autoscale/autoscaler.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::client {
namespace {

std::string listed(const Engine::Ids& ids) {
  return fmt::format("{} {}", ids.size() == 1 ? "job" : "jobs", fmt::join(ids, ", "));
}

}  // namespace

Autoscaler::Autoscaler(const ScalingSettings& settings, Engine& engine, AskDemand ask, Tell tell)
    : engine_(engine), ask_(std::move(ask)), tell_(std::move(tell)), scaling_(settings) {}

void Autoscaler::note_answer(Silence& silence) {
  if (!std::exchange(silence.told, {}).empty()) {
    tell_(fmt::format("{} is there again", silence.name));
  }
}

void Autoscaler::note_silence(Silence& silence, const std::string& reason) {
  // The reason may be another one each time, as "after 3.1 s".
  if (silence.told.empty()) {
    tell_(fmt::format("{}; nothing changes until that is over", reason));
  }
  silence.told = reason;
}

Observation Autoscaler::observe() {
  Observation seen;
  try {
    seen.demand = ask_();
    note_answer(server_);
  } catch (const ConnectionError& error) {
    note_silence(server_, error.what());
  } catch (const ServerError& error) {
    note_silence(server_, error.what());
  }
  try {
    seen.jobs = engine_.jobs();
    note_answer(listing_);
  } catch (const EngineError& error) {
    note_silence(listing_, error.what());
  }
  return seen;
}

void Autoscaler::show(const Decision& decision) {
  const auto show_all = [&](const char* what, const Engine::Ids& ids) {
    if (!ids.empty()) {
      tell_(fmt::format("would {} {}", what, listed(ids)));
    }
  };
  if (decision.submit > 0) {
    tell_(
        fmt::format("would submit {} with: {}",
                    decision.submit == 1 ? "a job" : fmt::format("{} jobs, each", decision.submit),
                    engine_.submission()));
  }
  show_all("withdraw", decision.withdraw);
  show_all("retire", decision.retire);
  show_all("end", decision.end);
  if (decision.changes_nothing()) {
    tell_(fmt::format("would change nothing: {} {} there", scaling_.jobs(),
                      scaling_.jobs() == 1 ? "job is" : "jobs are"));
  }
}

bool Autoscaler::carry_out(const Decision& decision, double now_s) {
  try {
    const auto order = [&](const char* what, const Engine::Ids& ids, auto give) {
      if (!ids.empty()) {
        (engine_.*give)(ids);
        tell_(fmt::format("{} {}", what, listed(ids)));
      }
    };
    order("withdrawn:", decision.withdraw, &Engine::withdraw);
    order("asked to leave:", decision.retire, &Engine::retire);
    order("ended:", decision.end, &Engine::end);
    Engine::Ids submitted;
    for (std::size_t i = 0; i < decision.submit; ++i) {
      submitted.push_back(engine_.submit());
      scaling_.note_submitted(submitted.back(), now_s);
      tell_(fmt::format("submitted: job {}", submitted.back()));
    }
    if (!decision.changes_nothing()) {
      note_answer(orders_);
    }
    return true;
  } catch (const EngineError& error) {
    if (decision.submit > 0) {
      scaling_.note_submission_failed(now_s);
    }
    note_silence(orders_, error.what());
    return false;
  }
}

bool Autoscaler::look(double now_s, bool only_tells) {
  const auto seen = observe();
  const auto decision = scaling_.decide(seen, now_s);
  for (const auto& sentence : decision.sentences) {
    tell_(sentence);
  }
  const bool answered = seen.demand && seen.jobs;
  if (only_tells) {
    if (answered) {
      show(decision);
    }
    return answered;
  }
  return carry_out(decision, now_s) && answered;
}

bool retire_all(Engine& engine, double patience_s, const std::function<bool(double seconds)>& wait,
                const Tell& tell) {
  constexpr double kPause_s = 1.0;
  double waited_s = 0.0;
  double next_s = 0.0;
  for (bool first = true;; first = false) {
    Engine::Ids waiting;
    Engine::Ids running;
    std::size_t leaving = 0;
    for (const auto& job : engine.jobs()) {
      if (job.state == JobState::kPending) {
        waiting.push_back(job.id);
      } else if (job.state == JobState::kRunning) {
        running.push_back(job.id);
      }
      leaving += job.state == JobState::kLeaving ? 1 : 0;
    }
    if (waiting.empty() && running.empty() && leaving == 0) {
      return true;
    }
    if (waited_s >= next_s) {
      next_s = waited_s + patience_s;
      engine.withdraw(waiting);
      first ? engine.retire(running) : engine.end(running);
      if (!waiting.empty()) {
        tell(fmt::format("withdrawn: {}", listed(waiting)));
      }
      if (!running.empty()) {
        tell(fmt::format("{} {}", first ? "asked to leave:" : "ended:", listed(running)));
      }
    }
    if (!wait(kPause_s)) {
      return false;
    }
    waited_s += kPause_s;
  }
}

}  // namespace oblique::client
