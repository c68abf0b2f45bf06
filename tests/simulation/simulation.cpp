#include "tests/simulation/simulation.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "tests/simulation/disk/simulated_disk.h"
#include "tests/simulation/simulated_peers.h"
#include "tests/simulation/simulated_server.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {
namespace {

class Simulation {
 public:
  Simulation(std::uint64_t seed, const SimulationSettings& settings)
      : settings_(settings),
        world_(seed),
        disk_(world_),
        server_(world_, disk_),
        workers_network_(world_, [this](const std::string& i,
                                        const std::string& f) { server_.worker_frame(i, f); }),
        clients_network_(world_, [this](const std::string& i, const std::string& f) {
          server_.client_frame(i, f);
        }) {
    disk_.files().forgets = settings.forgetful_syncs;
    server_.workers = &workers_network_;
    server_.clients = &clients_network_;
    server_.on_acknowledged = [this](const std::string& identity, std::uint64_t sequence) {
      check_acknowledged(identity, sequence);
    };
    server_.on_started = [this](const Found& found) { check_found(found); };
  }

  SimulationOutcome run() {
    server_.start();
    add_clients();
    add_workers();
    plan_faults();
    world_.run(
        world_.now_ms() + settings_.chaos_ms, [] { return false; }, [this] { check(); });
    heal();
    world_.run(
        world_.now_ms() + settings_.healing_ms, [this] { return is_over(); }, [this] { check(); });
    check_end();
    for (const auto& client : clients_) {
      outcome_["growths"] += client->growths;
      outcome_["renamings"] += client->renamings;
      outcome_["deletions"] += client->deletions;
    }
    for (const auto& worker : workers_) {
      outcome_["reported crashes"] += worker->reported_crashes;
    }
    outcome_["cleared rows"] = disk_.cleared_rows;
    outcome_["vanished peers"] = vanished_with_points_;
    outcome_["server kills"] = server_.crashes - server_.power_losses;
    outcome_["power losses"] = server_.power_losses;
    outcome_["deaths in writes"] = server_.deaths_in_writes;
    outcome_["failed syncs"] = server_.failed_syncs;
    outcome_["undone commits"] = disk_.model().undone_commits;
    outcome_["refused commits kept"] = disk_.model().refused_kept;
    outcome_["failed commits"] = disk_.model().failed_commits;
    return outcome_;
  }

 private:
  void add_clients() {
    const std::int64_t count = world_.between(1, 3);
    for (std::int64_t i = 0; i < count; ++i) {
      const auto points = static_cast<std::uint64_t>(world_.between(1, 60) * 7 + i);
      const auto mark = static_cast<std::uint64_t>(i + 1);
      clients_.push_back(
          std::make_unique<SimulatedClient>(world_, clients_network_, static_cast<std::uint64_t>(i),
                                            "study " + std::to_string(i), points + 2, mark));
      outcome_["points"] += clients_.back()->points();
      clients_.back()->start();
    }
  }

  void add_workers() {
    const std::int64_t count = world_.between(settings_.storms ? 2 : 1, 5);
    for (std::int64_t i = 0; i < count; ++i) {
      workers_.push_back(std::make_unique<SimulatedWorker>(
          world_, workers_network_, static_cast<std::uint64_t>(i), !settings_.storms));
      workers_.back()->restart(world_.between(0, 3000));
    }
  }

  void plan_faults() {
    const auto wait_ms = settings_.storms ? world_.between(20, 400) : world_.between(100, 3000);
    world_.after(wait_ms, [this] {
      if (world_.faults) {
        settings_.storms ? storm_fault() : fault();
        plan_faults();
      }
    });
  }

  /// Causes one fault of a storm. The first worker is only disconnected, never killed or frozen.
  void storm_fault() {
    const std::int64_t last = static_cast<std::int64_t>(workers_.size()) - 1;
    SimulatedWorker& victim = *workers_[static_cast<std::size_t>(world_.between(1, last))];
    switch (world_.between(0, 4)) {
      case 0:
      case 1:
        victim.restart(world_.between(0, 300));
        ++outcome_["worker faults"];
        break;
      case 2:
        victim.freeze(world_.between(100, 8000));
        ++outcome_["worker faults"];
        break;
      case 3:
        workers_network_.break_links(static_cast<std::uint64_t>(world_.between(0, last)));
        ++outcome_["cuts"];
        break;
      default:
        add_vanishing_peer();
        break;
    }
  }

  /// Adds a peer that joins as a worker under a new name, requests many batches and disappears.
  void add_vanishing_peer() {
    constexpr std::uint64_t kFirstPeer = 1000;  // higher than the number of any worker
    ++vanishing_peers_;
    const auto has_points = std::make_shared<bool>(false);
    const auto link =
        workers_network_.open(kFirstPeer + vanishing_peers_, [has_points](const auto& frame) {
          protocol::ServerToWorker message;
          *has_points = *has_points || (protocol::decode(frame, message) && message.has_batch());
        });
    protocol::WorkerMessage hello;
    protocol::set_protocol(*hello.mutable_hello());
    hello.mutable_hello()->set_solver_version("1");
    hello.mutable_hello()->set_threads(1);
    hello.mutable_hello()->set_process_id("vanishing " + std::to_string(vanishing_peers_));
    protocol::WorkerMessage credit;
    credit.mutable_credit()->set_batches(1000);
    workers_network_.send(link, protocol::encode(hello), false);
    workers_network_.send(link, protocol::encode(credit), false);
    world_.after(world_.between(10, 500), [this, link, has_points] {
      workers_network_.close(link, false);
      vanished_with_points_ += *has_points ? 1U : 0U;
    });
  }

  void fault() {
    const std::int64_t kind = world_.between(0, 17);
    if (kind < 6) {
      fault_of_disk_or_server();
    } else if (kind == 6) {
      std::set<std::uint64_t> parted;
      for (std::uint64_t peer = 0; peer < workers_.size(); ++peer) {
        if (world_.chance(0.6)) {
          parted.insert(peer);
        }
      }
      (world_.chance(0.8) ? workers_network_ : clients_network_)
          .part(std::move(parted), world_.between(500, 15'000));
      ++outcome_["partitions"];
    } else if (kind == 7) {
      // Moves the clock by up to 6 s or by up to 5.5 hours, forwards or backwards.
      world_.set_clock(world_.chance(0.5) ? world_.between(-6000, 6000)
                                          : world_.between(-20'000'000, 20'000'000));
      ++outcome_["clock jumps"];
    } else {
      fault_of_worker();
    }
  }

  void fault_of_disk_or_server() {
    SimulatedFiles& files = disk_.files();
    switch (world_.between(0, 8)) {
      case 0:
      case 1:
        if (server_.runs()) {
          server_.crash(world_.chance(0.4));
        } else if (world_.chance(0.3)) {
          disk_.crash(true);  // the power fails while no server runs
        }
        break;
      case 2:
      case 3:
        files.plan_death(world_.between(1, 80));
        break;
      case 4:
        files.full = true;
        world_.after(world_.between(100, 6000), [this] { disk_.files().full = false; });
        ++outcome_["disk faults"];
        break;
      case 5:
        files.failing = true;
        world_.after(world_.between(100, 6000), [this] { disk_.files().failing = false; });
        ++outcome_["disk faults"];
        break;
      case 6:
        files.plan_failing_sync(world_.between(1, 10));
        break;
      case 7:
        if (server_.runs()) {
          server_.stop();
          ++outcome_["server stops"];
        }
        break;
      default:
        server_.freeze(world_.between(100, 8000));
        break;
    }
  }

  void fault_of_worker() {
    SimulatedWorker& worker = *workers_[static_cast<std::size_t>(
        world_.between(0, static_cast<std::int64_t>(workers_.size()) - 1))];
    ++outcome_["worker faults"];
    const std::int64_t kind = world_.between(0, 6);
    if (kind < 2) {
      worker.freeze(world_.between(100, 8000));
    } else if (kind == 2) {
      worker.stop();
    } else {
      worker.restart(world_.between(0, 3000));
    }
  }

  void heal() {
    world_.faults = false;
    disk_.files().full = false;
    disk_.files().failing = false;
    disk_.files().plan_death(0);
    disk_.files().plan_failing_sync(0);
    workers_network_.heal();
    clients_network_.heal();
  }

  void check() {
    ++outcome_["events"];
    if (server_.runs()) {
      server_.service().scheduler().check_invariants();
    }
  }

  void check_acknowledged(const std::string& identity, std::uint64_t sequence) {
    const auto link = workers_network_.link_of(identity);
    for (const auto& worker : workers_) {
      const auto* results = worker->sent(link, sequence);
      // The server acknowledges results of a deleted study but does not store them.
      if (results == nullptr || disk_.model().study(results->study_id()) == nullptr) {
        continue;
      }
      for (const auto& result : results->results()) {
        if (!disk_.model().rows(results->study_id()).contains(result.point())) {
          throw Violation("point " + std::to_string(result.point()) +
                          " was acknowledged and is not on the disk");
        }
      }
    }
  }

  void check_found(const Found& found) {
    for (const auto& client : clients_) {
      for (const auto& study : found.studies) {
        if (study.name == client->name()) {
          client->check_found(study.state);
        }
      }
    }
  }

  bool is_over() const {
    for (const auto& client : clients_) {
      const auto* study = disk_.model().study(client->name());
      if (!client->wants_results() || study == nullptr ||
          study->state != server::StudyState::kDone ||
          disk_.model().rows(study->study_id).size() < client->left_in()) {
        return false;
      }
    }
    return server_.runs() && server_.has_cleared();
  }

  void check_end() {
    if (!server_.runs()) {
      throw Violation("no server runs at the end");  // a server is restarted soon after it ends
    }
    for (const auto& client : clients_) {
      const auto* study = disk_.model().study(client->name());
      if (study == nullptr || !client->was_acknowledged()) {
        throw Violation(client->name() + " was never accepted");
      }
      const auto& results = disk_.model().rows(study->study_id);
      const auto counts = server_.service().scheduler().study(study->study_id);
      if (results.size() != client->left_in() ||
          counts.left_out != client->points() - client->left_in()) {
        throw Violation(client->name() + " has " + std::to_string(results.size()) + " of " +
                        std::to_string(client->left_in()) + " points at the end, " +
                        std::to_string(counts.left_out) + " left out, " +
                        std::to_string(counts.leased) + " leased" + ", " +
                        server::state_name(study->state) + ", with " +
                        std::to_string(server_.service().scheduler().workers()) + " workers");
      }
      check_rows(client->mark(), results);
      if (study->state != server::StudyState::kDone) {
        throw Violation(client->name() + " has all rows but is not done");
      }
      if (counts.leased != 0) {
        throw Violation("a lease of " + client->name() + " leaked");
      }
    }
    disk_.check_rows();
  }

  void check_rows(std::uint64_t mark, const StoreModel::Rows& results) {
    for (const auto& [point, result] : results) {
      if (!is_answer(*result, mark)) {
        throw Violation("the row of point " + std::to_string(point) + " is wrong" +
                        (result->error().empty() ? "" : ": " + result->error()));
      }
    }
  }

  static bool is_answer(protocol::PointResult result, std::uint64_t mark) {
    result.clear_h_m();
    result.clear_mu();
    result.clear_e_star();
    result.clear_model();
    return result.SerializeAsString() == answer_to(mark, result.point()).SerializeAsString();
  }

  SimulationSettings settings_;
  World world_;
  SimulatedDisk disk_;
  SimulatedServer server_;
  Network workers_network_;
  Network clients_network_;
  std::vector<std::unique_ptr<SimulatedClient>> clients_;
  std::vector<std::unique_ptr<SimulatedWorker>> workers_;
  std::uint64_t vanishing_peers_ = 0;       // number of peers that disappear
  std::uint64_t vanished_with_points_ = 0;  // number of vanished peers with a batch of a study
  SimulationOutcome outcome_;
};

}  // namespace

void add(SimulationOutcome& all, const SimulationOutcome& more) {
  for (const auto& [what, times] : more) {
    all[what] += times;
  }
}

std::string text_of(const SimulationOutcome& outcome) {
  std::string text;
  for (const auto& [what, times] : outcome) {
    text += (text.empty() ? "" : ", ") + std::to_string(times) + " " + what;
  }
  return text;
}

SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings) {
  return Simulation(seed, settings).run();
}

}  // namespace oblique::simulation
