#include "server/loop/loop.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include <poll.h>

#include <spdlog/spdlog.h>

#include "proto/frames.h"
#include "server/database/shared_disk.h"
#include "server/doors/doors.h"
#include "server/loop/report_box.h"
#include "server/loop/shown_web.h"
#include "server/network/network.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{100};
/// What is not sent yet is still sent for so long at the end.
constexpr std::chrono::milliseconds kLinger{500};
/// A port's share of a turn: then the other port, the disk and the clock get theirs.
constexpr std::chrono::milliseconds kShareOfTurn{5};
/// When the database is gone, peers can still ask for so long why.
constexpr std::chrono::seconds kFarewell{3};
/// What has arrived when the server is told to stop is still read, for so long at most.
constexpr std::chrono::milliseconds kLongestLastRead{1000};

Instant now() {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  return {duration_cast<milliseconds>(Clock::now().time_since_epoch()).count(),
          duration_cast<milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count()};
}

}  // namespace

class Loop::Parts final : public Outbox {
 public:
  explicit Parts(LoopSettings settings)
      : drain_(settings.drain),
        on_turn_(settings.on_turn),
        doors_(settings.doors),
        store_(path_on_own_disk(settings.database, settings.allow_network_disk)),
        writer_(store_, [this](std::vector<WriteReport> r) { written_.put(std::move(r)); }),
        queries_(settings.database, settings.queries,
                 [this](QueryReport r) { queried_.put(std::array{std::move(r)}); }),
        reader_([this](ReadReport r) { done_aside_.put(std::array{std::move(r)}); }),
        network_(settings.network),
        workers_(network_.listen(doors_.address(), settings.worker_port,
                                 doors_.guard(PortKeeper::Port::kWorkers))),
        clients_(network_.listen(doors_.address(), settings.client_port,
                                 doors_.guard(PortKeeper::Port::kClients))),
        web_(web_of(settings)) {
    if (store_.is_new()) {
      spdlog::info("made the database {}: only its owner can read it (chmod lets others)",
                   settings.database);
    }
    ServiceSettings service = std::move(settings.service);
    service.database_id = store_.database_id();
    service.clients.access = name_of(doors_.access());
    service.last_study_id = store_.last_study_id();
    service.last_worker_id = store_.last_worker_id();
    // Above every number that an earlier run can have given, whatever the clock says.
    service.scheduler.first_lease_id = store_.count_start() << 40U;
    service_.emplace(std::move(service), *this, store_.studies(), now());
    for (const auto& sentence : store_.left_out()) {
      spdlog::warn("{}", sentence);
    }
  }

  LoopEnd run(int stop_fd, const std::function<void()>& take_stop) {
    writer_.resume_deletions();  // from here on it alone uses the store
    auto next_tick = Clock::now();
    std::array<pollfd, 6> items{{{network_.descriptor(), POLLIN, 0},
                                 {web_ ? web_->descriptor() : -1, POLLIN, 0},
                                 {written_.descriptor(), POLLIN, 0},
                                 {queried_.descriptor(), POLLIN, 0},
                                 {done_aside_.descriptor(), POLLIN, 0},
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
      take_reports();
      has_more = take_worker_messages();
      has_more = take_client_messages() || has_more || network_.has_more();
      note_departures();
      if (Clock::now() >= next_tick) {
        service_->tick(now());
        look_at_doors();
        show();
        tell_turn(drain_until_ ? LoopTurn::Stage::kDrains : LoopTurn::Stage::kRuns);
        next_tick = Clock::now() + kTick;
      }
      if (service_->storage_is_gone() && !farewell_until) {
        farewell_until = Clock::now() + kFarewell;
      }
    }
    return finish();
  }

  Delivery to_worker(const std::string& identity,
                     const protocol::ServerToWorker& message) override {
    return forward_to_worker(identity, protocol::encode(message));
  }
  Delivery forward_to_worker(const std::string& identity, const std::string& frame) override {
    return network_.send(identity, frame);
  }
  bool is_busy(const std::string& identity) const override { return network_.is_busy(identity); }
  bool has_unheard(const std::string& identity) const override {
    return network_.has_unheard(identity);
  }
  bool to_client(const std::string& identity, const protocol::ClientReply& reply) override {
    return forward_to_client(identity, protocol::encode(reply));
  }
  bool forward_to_client(const std::string& identity, const std::string& frame) override {
    if (Web::is_client(identity)) {
      return web_->put_reply(frame);
    }
    if (is_ending_) {
      last_answered_.push_back(identity);
    }
    return network_.send(identity, frame) != Delivery::kGone;
  }
  void write(WriteJob job) override { writer_.submit(std::move(job)); }
  bool query(QueryJob job) override { return queries_.submit(std::move(job)); }
  void more_rows(std::uint64_t query, std::uint64_t taken) override { queries_.more(query, taken); }
  void cancel_query(std::uint64_t ticket) override { queries_.cancel(ticket); }
  void read(ReadJob job) override { reader_.submit(std::move(job)); }
  void cancel_read(std::uint64_t ticket) override { reader_.cancel(ticket); }
  PeerCounts peer_counts() const override {
    PeerCounts counts;
    for (const auto& [key, share] : network_.key_shares().all()) {
      auto& of_key = counts.keys[share.holder->name];
      of_key = {share.holder->role, of_key.connections + share.connections};
    }
    const RefusalCounts& refusals = network_.refusals();
    for (std::size_t cause = 0; cause < refusals.size(); ++cause) {
      if (refusals.at(cause).count > 0) {
        counts.refusals.emplace_back(name_of(static_cast<RefusalCause>(cause)),
                                     refusals.at(cause).count);
      }
    }
    return counts;
  }
  void note(Severity severity, const std::string& text) override {
    constexpr std::array kLevels{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
    spdlog::log(kLevels.at(static_cast<std::size_t>(severity)), "{}", text);
  }

  std::string client_endpoint() const { return network_.endpoint(clients_); }
  std::string worker_endpoint() const { return network_.endpoint(workers_); }
  const Web* web() const { return web_.get(); }

 private:
  void show() {
    if (web_) {
      web_->tick({*service_, network_, writer_}, now().steady_ms);
    }
  }

  void take_reports() {
    for (const auto& frame : web_ ? web_->take_requests() : std::vector<std::string>()) {
      service_->client_frame(ServiceClient::kIdentity, frame, now());
    }
    for (const auto& report : written_.take()) {
      service_->written(std::get<WriteReport>(report), now());
    }
    for (auto& report : queried_.take()) {
      service_->queried(std::get<QueryReport>(std::move(report)));
    }
    for (const auto& report : done_aside_.take()) {
      service_->request_read(std::get<ReadReport>(report), now());
    }
  }

  /// True when messages are left that could be taken at once.
  bool take_worker_messages() {
    return take_messages(
        workers_, [this](const std::string& worker) { return service_->has_room_for(worker); },
        [this](const Incoming& incoming) {
          service_->worker_frame(incoming.identity, frame_of(incoming), now(), incoming.holder);
        });
  }

  /// The same. Who does not take what it asked for is not asked what it wants next.
  bool take_client_messages() {
    return take_messages(
        clients_, [this](const std::string& client) { return !network_.is_busy(client); },
        [this](const Incoming& incoming) {
          service_->client_frame(incoming.identity, frame_of(incoming), now(), incoming.holder);
        });
  }

  template <typename Take>
  bool take_messages(Network::Port port, const Network::MayTake& may_take, const Take& take) {
    const auto until = Clock::now() + kShareOfTurn;
    while (const auto incoming = network_.next(port, may_take)) {
      take(*incoming);
      if (Clock::now() >= until) {
        return true;
      }
    }
    return false;
  }

  /// What is not of one frame is passed on as a frame that no message has.
  static std::string_view frame_of(const Incoming& incoming) {
    return incoming.message.is_single ? std::string_view(incoming.message.body)
                                      : std::string_view("\xff", 1);
  }

  /// Nobody waits for queries of a client that has gone. A flood of ends becomes none of lines.
  void note_departures() {
    for (const Departure& departure : network_.take_departures()) {
      service_->client_left(departure.identity);
      if (departure.refused) {
        note_refusal(departure, *departure.refused);
      } else if (!departure.reason.empty() && std::has_single_bit(++ended_connections_)) {
        spdlog::warn("a connection was ended: {} ({} ended so far)", departure.reason,
                     ended_connections_);
      }
    }
  }

  void note_refusal(const Departure& departure, RefusalCause cause) {
    std::uint64_t& so_far = refused_.at(static_cast<std::size_t>(cause));
    if (std::has_single_bit(++so_far)) {
      spdlog::warn("{} was refused: {} ({} refused so far: {})", departure.address,
                   departure.reason, so_far, name_of(cause));
    }
  }

  void look_at_doors() {
    const Doors::News news = doors_.look(now().steady_ms);
    for (const auto& line : news.lines) {
      spdlog::log(line.is_warning ? spdlog::level::warn : spdlog::level::info, "{}", line.text);
    }
    if (news.admission_changed) {
      network_.admission_changed();
    }
  }

  void tell_turn(LoopTurn::Stage stage) const {
    on_turn_({stage, service_->scheduler().workers(), service_->scheduler().leases()});
  }

  /// Whether the loop goes on although it was told to stop.
  bool begin_drain(const std::function<void()>& take_stop) {
    if (drain_until_ || drain_.count() == 0 || !take_stop) {
      return false;
    }
    take_stop();
    drain_until_ = Clock::now() + drain_;
    spdlog::info(
        "draining: nothing more is handed out; waits up to {} s for {} batches that are with "
        "workers. A second signal ends it at once",
        std::chrono::duration<double>(drain_).count(), service_->scheduler().leases());
    service_->drain(now());
    return true;
  }

  /// Whether nothing is left to wait for, or no time.
  bool is_drained() const {
    const bool is_complete = drain_until_ && service_->is_drained();
    const bool is_late = drain_until_ && Clock::now() >= *drain_until_;
    if (is_complete) {
      spdlog::info("drained: all that was handed out is stored or given back");
    } else if (is_late) {
      spdlog::warn("not drained in time: {} batches are with workers, who deliver them later",
                   service_->scheduler().leases());
    }
    return is_complete || is_late;
  }

  LoopEnd finish() {
    spdlog::info("stopping");
    tell_turn(LoopTurn::Stage::kEnds);
    is_ending_ = true;
    queries_.stop();
    service_->stop(now());
    show();
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
    take_reports();
    network_.flush(kLinger);
    let_clients_read();
    if (lost > 0) {
      spdlog::error("{} changes could not be made durable and were not acknowledged", lost);
    }
    return {lost, service_->storage_is_gone()};
  }

  /// libzmq forgets what a client has not read yet when the connection ends: who was answered at
  /// the end gets the time to read it, and mostly goes by itself then.
  void let_clients_read() {
    const auto until = Clock::now() + kLinger;
    const auto is_there = [this](const auto& client) { return network_.is_connected(client); };
    while (std::any_of(last_answered_.begin(), last_answered_.end(), is_there) &&
           Clock::now() < until) {
      constexpr int kSlice_ms = 10;
      pollfd item{network_.descriptor(), POLLIN, 0};
      ::poll(&item, 1, kSlice_ms);
      network_.collect(now().steady_ms);
    }
  }

  const std::chrono::milliseconds drain_;
  const std::function<void(const LoopTurn&)> on_turn_;
  std::optional<Clock::time_point> drain_until_;  ///< none: it does not drain
  Doors doors_;
  Store store_;
  ReportBox written_;
  ReportBox queried_;
  ReportBox done_aside_;
  Writer writer_;
  QueryPool queries_;
  RequestReader reader_;
  Network network_;
  Network::Port workers_;
  Network::Port clients_;
  std::unique_ptr<Web> web_;
  std::uint64_t ended_connections_ = 0;
  std::array<std::uint64_t, kRefusalCauses> refused_{};  ///< by cause
  bool is_ending_ = false;
  std::vector<std::string> last_answered_;  ///< clients that were sent something at the end
  std::optional<Service> service_;
};

Loop::Loop(LoopSettings settings) : parts_(std::make_unique<Parts>(std::move(settings))) {}
Loop::~Loop() = default;

std::string Loop::client_endpoint() const {
  return parts_->client_endpoint();
}
std::string Loop::worker_endpoint() const {
  return parts_->worker_endpoint();
}
std::string Loop::http_url() const {
  return parts_->web() != nullptr ? parts_->web()->url() : std::string();
}
std::string Loop::page_url() const {
  return parts_->web() != nullptr ? parts_->web()->page_url() : std::string();
}
LoopEnd Loop::run(int stop_fd, const std::function<void()>& take_stop) {
  return parts_->run(stop_fd, take_stop);
}

}  // namespace oblique::server
