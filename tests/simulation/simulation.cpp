#include "tests/simulation/simulation.h"

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/simulation/simulated_client.h"
#include "tests/simulation/simulated_disk.h"
#include "tests/simulation/simulated_server.h"
#include "tests/simulation/simulated_worker.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {
namespace {

class Simulation {
 public:
  Simulation(std::uint64_t seed, const SimulationSettings& settings)
      : settings_(settings),
        world_(seed),
        // Random crashes hit innocent points too, so that blame is tried in runs of its own.
        server_(world_, disk_, settings.killers ? 3 : 1000),
        workers_network_(world_, [this](const std::string& i,
                                        const std::string& f) { server_.worker_frame(i, f); }),
        clients_network_(world_, [this](const std::string& i, const std::string& f) {
          server_.client_frame(i, f);
        }) {
    world_.faults = !settings.killers;
    server_.workers = &workers_network_;
    server_.clients = &clients_network_;
    server_.on_acknowledged = [this](const std::string& identity, std::uint64_t sequence) {
      check_acknowledged(identity, sequence);
    };
  }

  SimulationOutcome run() {
    server_.start();
    add_clients();
    add_workers();
    if (world_.faults) {
      plan_faults();
      const std::int64_t end_ms = world_.now_ms() + settings_.chaos_ms;
      world_.run(
          end_ms, [] { return false; }, [this] { check(); });
    }
    heal();
    const std::int64_t healed_ms = world_.now_ms();
    world_.run(
        healed_ms + settings_.healing_ms, [this] { return is_over(); }, [this] { check(); });
    outcome_.healed_after_ms = world_.now_ms() - healed_ms;
    check_end();
    outcome_.server_crashes = server_.crashes;
    return outcome_;
  }

 private:
  void add_clients() {
    const std::int64_t count = world_.between(1, 3);
    for (std::int64_t i = 0; i < count; ++i) {
      // Sizes differ, for answers name their study by its size.
      const auto points = static_cast<std::uint64_t>(world_.between(1, 60) * 7 + i);
      clients_.push_back(std::make_unique<SimulatedClient>(
          world_, clients_network_, "study " + std::to_string(i), points + 2));
      outcome_.points += clients_.back()->points();
      clients_.back()->start();
      if (settings_.killers) {
        auto& killers = killers_[points + 2];
        const std::int64_t killing = world_.between(0, 2);
        while (static_cast<std::int64_t>(killers.size()) < killing) {
          killers.insert(
              static_cast<std::uint64_t>(world_.between(0, static_cast<std::int64_t>(points) + 1)));
        }
      }
    }
  }

  void add_workers() {
    const std::int64_t count = world_.between(1, 5);
    for (std::int64_t i = 0; i < count; ++i) {
      workers_.push_back(std::make_unique<SimulatedWorker>(world_, workers_network_, killers_));
      workers_.back()->restart(world_.between(0, 3000));
    }
  }

  void plan_faults() {
    world_.after(world_.between(100, 3000), [this] {
      if (world_.faults) {
        fault();
        plan_faults();
      }
    });
  }

  void fault() {
    SimulatedWorker& worker = *workers_[static_cast<std::size_t>(
        world_.between(0, static_cast<std::int64_t>(workers_.size()) - 1))];
    switch (world_.between(0, 9)) {
      case 0:
      case 1:
        if (server_.runs()) {
          server_.crash(world_.chance(0.3));
        }
        break;
      case 2:
        disk_.full = true;
        world_.after(world_.between(100, 6000), [this] { disk_.full = false; });
        break;
      case 3:
      case 4:
        worker.freeze(world_.between(100, 8000));
        ++outcome_.worker_faults;
        break;
      case 5:
        worker.stop();
        ++outcome_.worker_faults;
        break;
      default:
        worker.restart(world_.between(0, 3000));
        ++outcome_.worker_faults;
        break;
    }
  }

  void heal() {
    world_.faults = false;
    disk_.full = false;
    workers_network_.heal();
    clients_network_.heal();
  }

  void check() {
    ++outcome_.events;
    if (server_.runs()) {
      server_.service().scheduler().check_invariants();
    }
  }

  void check_acknowledged(const std::string& identity, std::uint64_t sequence) {
    const auto link = workers_network_.link_of(identity);
    for (const auto& worker : workers_) {
      const auto* results = worker->sent(link, sequence);
      if (results == nullptr) {
        continue;
      }
      for (const auto& result : results->results()) {
        if (!disk_.has_result(results->study_id(), result.point())) {
          throw Violation("point " + std::to_string(result.point()) +
                          " was acknowledged and is not on the disk");
        }
      }
    }
  }

  bool is_over() const {
    for (const auto& client : clients_) {
      const auto* study = disk_.study(client->name());
      if (!client->wants_results() || study == nullptr ||
          study->state != server::StudyState::kDone ||
          disk_.results(study->study_id).size() < client->points()) {
        return false;
      }
    }
    return true;
  }

  void check_end() {
    for (const auto& client : clients_) {
      const auto* study = disk_.study(client->name());
      if (study == nullptr || !client->was_acknowledged()) {
        throw Violation(client->name() + " was never accepted");
      }
      const auto& results = disk_.results(study->study_id);
      const auto counts = server_.service().scheduler().study(study->study_id);
      if (results.size() != client->points()) {
        throw Violation(client->name() + " has " + std::to_string(results.size()) + " of " +
                        std::to_string(client->points()) + " points at the end, " +
                        std::to_string(counts.leased) + " leased" +
                        (counts.cancelled ? ", cancelled" : "") + ", with " +
                        std::to_string(server_.service().scheduler().workers()) + " workers");
      }
      check_rows(client->points(), results);
      if (study->state != server::StudyState::kDone) {
        throw Violation(client->name() + " is complete and not done");
      }
      if (counts.leased != 0) {
        throw Violation("a lease of " + client->name() + " leaked");
      }
    }
  }

  void check_rows(std::uint64_t size,
                  const std::map<std::uint64_t, protocol::PointResult>& results) {
    const auto killers = killers_.find(size);
    for (const auto& [point, result] : results) {
      const bool kills = killers != killers_.end() && killers->second.contains(point);
      outcome_.failed_points += kills ? 1U : 0U;
      if (kills ? result.error().empty()
                : result.SerializeAsString() != answer_to(size, point).SerializeAsString()) {
        throw Violation("the row of point " + std::to_string(point) + " is wrong");
      }
    }
  }

  SimulationSettings settings_;
  World world_;
  SimulatedDisk disk_;
  SimulatedServer server_;
  Network workers_network_;
  Network clients_network_;
  SimulatedWorker::Killers killers_;
  std::vector<std::unique_ptr<SimulatedClient>> clients_;
  std::vector<std::unique_ptr<SimulatedWorker>> workers_;
  SimulationOutcome outcome_;
};

}  // namespace

SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings) {
  return Simulation(seed, settings).run();
}

}  // namespace oblique::simulation
