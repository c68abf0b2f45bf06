#include "server/event_loop/event_loop.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include <poll.h>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "server/database/database_file.h"
#include "server/web/answers/service_client.h"

namespace oblique::server {
namespace {

constexpr std::chrono::milliseconds kTick{100};
/// Maximum time for sending the remaining output when the server ends.
constexpr std::chrono::milliseconds kLinger{500};
/// Maximum time for the messages of one port in each turn of the loop.
constexpr std::chrono::milliseconds kShareOfTurn{5};
/// Time after the loss of the database in which the server still answers requests, with an error.
constexpr std::chrono::seconds kFarewell{3};
/// Maximum time for reading messages that have already arrived when the server ends.
constexpr std::chrono::milliseconds kLongestLastRead{1000};

Instant now() {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  return {duration_cast<milliseconds>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          duration_cast<milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count()};
}

/// Returns null if HTTP is off. If the address is in use and the server may run without HTTP, logs
/// the reason and returns null.
std::unique_ptr<Web> make_web(const LoopSettings& settings) {
  if (!settings.web) {
    return nullptr;
  }
  WebSettings web = *settings.web;
  web.database = settings.database;
  web.solver_version = settings.service.solver_version;
  try {
    return std::make_unique<Web>(std::move(web));
  } catch (const std::runtime_error& error) {
    const std::string what =
        std::string(error.what()) + " (choose another address with --http, or --http off)";
    if (!settings.web->may_be_missing) {
      throw std::runtime_error(what);
    }
    spdlog::warn("the server runs without HTTP: {}", what);
    return nullptr;
  }
}

}  // namespace

EventLoop::EventLoop(LoopSettings settings)
    : drain_(settings.drain),
      on_turn_(settings.on_turn),
      access_(settings.access),
      store_(path_on_own_disk(settings.database, settings.allow_network_disk)),
      writer_(store_,
              [this](std::vector<WriteReport> reports) {
                completions_.put([this, reports = std::move(reports)] {
                  for (const WriteReport& report : reports) {
                    service_->written(report, now());
                  }
                });
              }),
      queries_(settings.database, settings.queries,
               [this](QueryReport report) {
                 completions_.put([this, report = std::move(report)]() mutable {
                   service_->query_report(std::move(report));
                 });
               }),
      checks_(
          [this](Completion done) { completions_.put([done = std::move(done)] { done(now()); }); }),
      network_(settings.network),
      workers_(network_.listen(access_.address(), settings.worker_port,
                               access_.security(AccessControl::PortRole::kWorkers))),
      clients_(network_.listen(access_.address(), settings.client_port,
                               access_.security(AccessControl::PortRole::kClients))),
      web_(make_web(settings)) {
  if (store_.is_new()) {
    spdlog::info("created the database {}: only its owner can read it (chmod lets others)",
                 settings.database);
  }
  ServiceSettings service = std::move(settings.service);
  service.database_id = store_.database_id();
  service.clients.access = name_of(access_.mode());
  service.last_study_id = store_.last_study_id();
  service.last_worker_id = store_.last_worker_id();
  // Lease numbers are above all numbers of earlier runs, even if the clock was set back.
  service.scheduler.first_lease_id = store_.count_start() << 40U;
  std::vector<StoredStudy> studies = store_.studies();
  for (const auto& sentence : store_.skipped()) {
    spdlog::warn("{}", sentence);
  }
  Ports& ports = *this;
  // The service may write at once. From here on only the writer's thread uses the store.
  service_.emplace(service, ports, std::move(studies), now());
}

// ---- Ports -------------------------------------------------------------------------------------

Delivery EventLoop::to_worker(const std::string& identity, const std::string& frame) {
  return network_.send(identity, frame);
}

bool EventLoop::to_client(const std::string& identity, const std::string& frame) {
  if (Web::is_client(identity)) {
    return web_->put_reply(frame);
  }
  if (is_ending_) {
    last_answered_.push_back(identity);
  }
  return network_.send(identity, frame) != Delivery::kGone;
}

void EventLoop::add_peers(protocol::WorkersReply& reply) const {
  for (std::size_t cause = 0; cause < network_.refusals().size(); ++cause) {
    if (const auto count = network_.refusals().at(cause); count > 0) {
      auto& refusals = *reply.add_refusals();
      refusals.set_reason(std::string(name_of(static_cast<RefusalCause>(cause))));
      refusals.set_peers(count);
    }
  }
}

void EventLoop::log(Severity severity, const std::string& text) {
  constexpr std::array kLevels{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  spdlog::log(kLevels.at(static_cast<std::size_t>(severity)), "{}", text);
}

// ---- The loop ----------------------------------------------------------------------------------

LoopEnd EventLoop::run(int stop_fd, const std::function<void()>& take_stop) {
  writer_.resume_deletions();
  auto next_tick = Clock::now();
  std::array<pollfd, 4> items{{{network_.descriptor(), POLLIN, 0},
                               {web_ ? web_->descriptor() : -1, POLLIN, 0},
                               {completions_.descriptor(), POLLIN, 0},
                               {stop_fd, POLLIN, 0}}};
  bool has_more = false;
  std::optional<Clock::time_point> farewell_until;
  while (!farewell_until || Clock::now() < *farewell_until) {
    if ((items.back().revents != 0 && !begin_drain(take_stop)) || is_drained()) {
      break;
    }
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_tick - Clock::now());
    ::poll(items.data(), items.size(),
           has_more ? 0 : static_cast<int>(std::max<std::int64_t>(wait.count(), 0)));
    network_.collect(now().steady_ms);
    take_completions();
    has_more = take_worker_messages();
    has_more = take_client_messages() || has_more || network_.has_more();
    note_disconnects();
    if (Clock::now() >= next_tick) {
      tick();
      next_tick = Clock::now() + kTick;
    }
    if (service_->storage_is_gone() && !farewell_until) {
      farewell_until = Clock::now() + kFarewell;
    }
  }
  return finish();
}

void EventLoop::tick() {
  service_->tick(now());
  check_access();
  publish();
  report(drain_until_ ? LoopState::Stage::kDrains : LoopState::Stage::kRuns);
}

void EventLoop::take_completions() {
  for (const auto& frame : web_ ? web_->take_requests() : std::vector<std::string>()) {
    service_->client_frame(ServiceClient::kIdentity, frame, now());
  }
  completions_.run();
}

bool EventLoop::take_worker_messages() {
  return take_messages(
      workers_, [this](const std::string& /*worker*/) { return service_->has_room(); },
      [this](const Incoming& incoming) {
        service_->worker_frame(incoming.identity, incoming.body, now(), incoming.key);
      });
}

bool EventLoop::take_client_messages() {
  return take_messages(
      clients_, [this](const std::string& client) { return !network_.is_busy(client); },
      [this](const Incoming& incoming) {
        service_->client_frame(incoming.identity, incoming.body, now(), incoming.key);
      });
}

template <typename Take>
bool EventLoop::take_messages(Network::Port port, const Network::MayTake& may_take,
                              const Take& take) {
  const auto until = Clock::now() + kShareOfTurn;
  while (const auto incoming = network_.next(port, may_take)) {
    take(*incoming);
    if (Clock::now() >= until) {
      return true;
    }
  }
  return false;
}

void EventLoop::note_disconnects() {
  for (const Disconnect& disconnect : network_.take_disconnects()) {
    service_->client_left(disconnect.identity);
    if (disconnect.refused) {
      service_->log_stranger(
          fmt::format("{} was refused: {}", disconnect.address, disconnect.reason));
    } else if (!disconnect.reason.empty()) {
      service_->log_stranger(fmt::format("a connection was ended: {}", disconnect.reason));
    }
  }
}

void EventLoop::check_access() {
  if (access_.refresh(now().steady_ms)) {
    network_.admission_changed();
  }
}

void EventLoop::publish() {
  if (web_) {
    web_->tick({*service_, network_, writer_}, now().steady_ms);
  }
}

void EventLoop::report(LoopState::Stage stage) const {
  on_turn_({stage, service_->scheduler().workers(), service_->scheduler().leases()});
}

// ---- The end -----------------------------------------------------------------------------------

/// Returns whether the loop continues after a request to stop.
bool EventLoop::begin_drain(const std::function<void()>& take_stop) {
  if (drain_until_ || drain_.count() == 0 || !take_stop) {
    return false;
  }
  take_stop();
  drain_until_ = Clock::now() + drain_;
  spdlog::info(
      "draining: no further batches are sent; waiting up to {} s for {} batches of "
      "workers. A second signal stops the server at once",
      std::chrono::duration<double>(drain_).count(), service_->scheduler().leases());
  service_->drain(now());
  return true;
}

bool EventLoop::is_drained() const {
  const bool is_complete = drain_until_ && service_->is_drained();
  const bool is_late = drain_until_ && Clock::now() >= *drain_until_;
  if (is_complete) {
    spdlog::info("drained: all batches are stored or given back");
  } else if (is_late) {
    spdlog::warn(
        "not drained in time: {} batches are still with workers, which will deliver them later",
        service_->scheduler().leases());
  }
  return is_complete || is_late;
}

LoopEnd EventLoop::finish() {
  spdlog::info("stopping");
  report(LoopState::Stage::kEnds);
  is_ending_ = true;
  queries_.stop();
  service_->stop(now());
  publish();
  const auto until = Clock::now() + kLongestLastRead;
  bool has_more = true;
  while (has_more && Clock::now() < until) {
    pollfd item{network_.descriptor(), POLLIN, 0};
    has_more = ::poll(&item, 1, 0) > 0;
    network_.collect(now().steady_ms);
    has_more = take_worker_messages() || has_more;
  }
  take_client_messages();
  const std::size_t lost = writer_.finish();
  take_completions();
  network_.flush(kLinger);
  wait_for_readers();
  if (lost > 0) {
    spdlog::error("{} changes could not be stored and were not acknowledged", lost);
  }
  return {lost, service_->storage_is_gone()};
}

/// Waits until clients have read their last reply, because libzmq drops unread messages when a
/// connection ends. Most clients disconnect after the reply.
void EventLoop::wait_for_readers() {
  const auto until = Clock::now() + kLinger;
  const auto is_there = [this](const auto& client) { return network_.is_connected(client); };
  while (std::ranges::any_of(last_answered_, is_there) && Clock::now() < until) {
    constexpr int kSlice_ms = 10;
    pollfd item{network_.descriptor(), POLLIN, 0};
    ::poll(&item, 1, kSlice_ms);
    network_.collect(now().steady_ms);
  }
}

}  // namespace oblique::server
