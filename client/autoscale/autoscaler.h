#pragma once

#include <functional>
#include <optional>
#include <string>

#include "client/autoscale/demand.h"
#include "client/autoscale/engine.h"
#include "client/autoscale/scaling.h"
#include "client/service/connection.h"

namespace oblique::client {

/// Asks a server and an engine, and has the engine do what follows. Whoever does not answer is
/// named once, and once more when it is back; nothing changes meanwhile.
class Autoscaler {
 public:
  /// What the server says; throws what Connection throws.
  using AskDemand = std::function<Demand()>;

  Autoscaler(const ScalingSettings& settings, Engine& engine, AskDemand ask, Tell tell);

  /// Looks once at `now_s`, of any clock that never runs backwards, and does what follows; with
  /// `only_tells`, says it. False when server or engine did not answer or refused.
  bool look(double now_s, bool only_tells = false);

  std::size_t jobs() const { return scaling_.jobs(); }

 private:
  /// Who does not answer, and what was told of it.
  struct Silence {
    std::string name;
    std::string told{};
  };

  void note_answer(Silence& silence);
  void note_silence(Silence& silence, const std::string& reason);
  Observation observe();
  void show(const Decision& decision);
  bool carry_out(const Decision& decision, double now_s);

  Engine& engine_;
  AskDemand ask_;
  Tell tell_;
  Scaling scaling_;
  Silence server_{"the server"};
  Silence listing_{"the list of jobs"};
  Silence orders_{"the engine"};
};

/// Has all jobs of `engine` leave: those that wait are withdrawn, those that run are asked to, and
/// asked to end after `patience_s`. Waits until none is listed any more, looking about every second
/// with `wait`, which is false to give up. Gives whether all are gone. Throws EngineError.
bool retire_all(Engine& engine, double patience_s, const std::function<bool(double seconds)>& wait,
                const Tell& tell);

}  // namespace oblique::client
