#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/network/delivery.h"
#include "server/queries/query_pool.h"
#include "server/scheduler/scheduler.h"
#include "server/service/note_rate.h"
#include "server/service/request_reader.h"
#include "server/service/settled_rates.h"
#include "server/service/study_states.h"
#include "server/store/store.h"
#include "server/store/writer.h"

namespace oblique::server {

/// A moment by two clocks.
struct Instant {
  std::int64_t steady_ms;  ///< never runs backwards
  std::int64_t utc_ms;     ///< since 1970
};

enum class Severity { kInfo, kWarning, kError };

/// What the service asks of the world around it. Nothing here may block or call the service back.
class Outbox {
 public:
  virtual ~Outbox() = default;

  virtual Delivery to_worker(const std::string& identity,
                             const protocol::ServerToWorker& message) = 0;
  /// The same for a message that is encoded already.
  virtual Delivery forward_to_worker(const std::string& identity, const std::string& frame) = 0;
  /// More waits to go out to that worker than should.
  virtual bool is_busy(const std::string& identity) const = 0;
  /// False when the client is gone; the reply is dropped then: it asks again.
  virtual bool to_client(const std::string& identity, const protocol::ClientReply& reply) = 0;
  /// The same for a reply that is encoded already.
  virtual bool forward_to_client(const std::string& identity, const std::string& frame) = 0;
  /// `Service::written` is called once the job's fate is known.
  virtual void write(WriteJob job) = 0;
  /// `Service::queried` is called with the answer. False when too many queries wait.
  virtual bool query(QueryJob job) = 0;
  /// Nobody waits for that query any more.
  virtual void cancel_query(std::uint64_t ticket) = 0;
  /// `Service::request_read` is called with what the frame says.
  virtual void read(ReadJob job) = 0;
  /// For the log.
  virtual void note(Severity severity, const std::string& text) = 0;
};

struct ServiceSettings {
  SchedulerSettings scheduler;
  std::uint32_t heartbeat_interval_ms = 900;
  std::string solver_version;  ///< workers with another one are told so
  /// Results messages of one worker that wait for the disk. A sound worker stops long before.
  std::size_t most_unstored_messages = 100'000;
  /// Results that wait for the disk, as bytes of their messages. With so many of one worker, or of
  /// all, no more are taken: they wait where they are.
  std::size_t unstored_bytes_of_worker = std::size_t{16} << 20U;
  std::size_t unstored_bytes = std::size_t{128} << 20U;
  /// With so many no batch goes out, until half of them are stored.
  std::size_t unstored_bytes_to_hold = std::size_t{16} << 20U;
  std::size_t unstored_messages_to_hold = 20'000;
  std::size_t most_waiting_changes = 10'000;  ///< of clients, that wait for the disk
  /// How often a client hears that its query waits or runs, by which the server also finds out that
  /// the client is gone.
  std::int64_t still_working_every_ms = 1000;
  /// Longer requests are read on a thread of their own; so many of them wait there at most.
  std::size_t longest_inline_bytes = std::size_t{64} * 1024;
  std::size_t most_long_requests = 64;
  std::size_t most_long_requests_of_one = 2;  ///< client
  std::size_t most_long_bytes = std::size_t{64} * 1024 * 1024;
  std::size_t largest_page = 1000;  ///< studies or workers in one reply
  std::string database_id;
  std::uint64_t last_study_id = 0;
  std::uint64_t last_worker_id = 0;
};

/// Speaks with workers and clients in messages, keeps the scheduler informed and carries out its
/// decisions. No sockets, no clock, no thread: tests drive it message by message. Every frame is
/// taken for hostile until it is parsed. Not thread-safe.
class Service {
 public:
  Service(ServiceSettings settings, Outbox& outbox, std::vector<StoredStudy> studies, Instant now);

  void worker_frame(const std::string& identity, std::string_view frame, Instant now);
  void client_frame(const std::string& identity, std::string_view frame, Instant now);
  void written(const WriteReport& report, Instant now);
  void queried(QueryReport report);
  void request_read(ReadReport report, Instant now);
  /// To be called several times a second.
  void tick(Instant now);
  /// Tells the workers that the server stops. Nothing is handed out afterwards; results are still
  /// taken.
  void stop(Instant now);

  /// Whether a message of that worker should be taken now, or wait until more is stored. Who waits
  /// so is not taken for silent.
  bool has_room_for(std::string_view worker) const;

  /// Something is on its way to the disk.
  bool waits_for_disk() const { return !writes_.empty(); }
  /// The database is not where it was: nothing more can be stored, and the server should end.
  bool storage_is_gone() const { return storage_is_gone_; }
  /// Frames that no sound peer sends.
  std::uint64_t bad_frames() const { return bad_frames_; }
  const Scheduler& scheduler() const { return scheduler_; }
  const SettledRates& rates() const { return rates_; }

 private:
  struct Client {
    std::string identity;
    std::uint64_t request_id;

    bool operator==(const Client&) const = default;
  };
  struct Query {
    Client client;
    std::int64_t next_word_ms;  // when the client is to hear of it again
    bool runs = false;
  };
  struct Peer {
    std::string identity;
    std::uint32_t protocol_version;
    std::string name;
    std::uint32_t threads;
    std::string solver_version;
    std::string instruction_set;
    std::size_t unstored_messages = 0;
    std::size_t unstored_bytes = 0;
    std::uint32_t hellos = 1;  // on its one connection
    bool is_busy = false;      // as the scheduler knows
    std::string joined_at{};
    bool has_row = false;  // in the database, since its first result
  };
  struct LongRequest {
    Client client;
    std::size_t bytes;
  };
  // What a write stands for.
  struct OfResults {
    ResultsStored event;
    std::uint32_t attempt;
    std::size_t bytes;  // of the message
  };
  struct OfStudy {
    StudyId study;
  };
  struct OfState {
    StudyId study;
    StudyState state;
    Client client;
    bool submitted;  // the client asked for it by submitting the study again
  };
  struct OfFailures {
    StudyId study;
    IntervalSet points;
    Client client;
  };
  struct OfShare {
    StudyId study;
    StudyShare share;
    Client client;  // submitted the study again
  };
  struct OfNothing {};
  using Write = std::variant<OfResults, OfStudy, OfState, OfShare, OfFailures, OfNothing>;

  // service_workers.cpp
  void hello(const std::string& identity, const protocol::WorkerHello& hello, Instant now);
  void results(WorkerId worker, protocol::Results results, Instant now);
  void forget(WorkerId worker);
  void bad_frame(const std::string& who);
  void bad_peer(WorkerId worker, const std::string& what, Instant now);
  void oversized_frame(const std::string& identity, Instant now);
  void note_of_worker(Severity severity, const std::string& text, Instant now);
  void tell_of_version(WorkerId worker, Instant now);
  void send_probe(const SendProbe& effect);

  // service_clients.cpp
  void set_state(const Client& client, StudyId id, StudyState state, bool submitted, Instant now);
  void read_elsewhere(const std::string& identity, std::string_view frame);
  void take(const std::string& identity, const ReadRequest& read, Instant now);
  void submit(const Client& client, const ReadRequest& read, Instant now);
  void continue_study(const Client& client, StudyId id, Instant now);
  void change(const Client& client, const protocol::ChangeRequest& request, Instant now);
  void retry(const Client& client, StudyId id, Instant now);
  void query(const Client& client, const protocol::QueryRequest& request, Instant now);
  void tell_of_queries(Instant now);
  void reply_submitted(const Client& client, StudyId id, bool created);
  void reply_changed(const Client& client, StudyId id, std::uint64_t retried, Instant now);
  void reply_error(const Client& client, const std::string& message);

  // service_status.cpp
  void status(const Client& client, const protocol::StatusRequest& request, Instant now);
  void workers(const Client& client, const protocol::WorkersRequest& request, Instant now);
  protocol::StudyStatus status_of(StudyId id, Instant now) const;
  protocol::WorkerStatus status_of_worker(WorkerId id, const Peer& peer, Instant now) const;
  std::string what_it_waits_for(StudyId id, const StudyCounts& counts) const;

  // service.cpp
  void feed(const Event& event, Instant now, protocol::Results* message = nullptr);
  void perform(const Effect& effect, Instant now, protocol::Results* message);
  void handle(const Event& event, Instant now, protocol::Results* message);
  void send(WorkerId worker, const protocol::ServerToWorker& message);
  bool has_room_for(const Peer& peer) const;
  void hold_while_disk_is_behind(Instant now);
  void look_after_workers(Instant now);
  void define_study(const DefineStudy& effect);
  void note_delivery(WorkerId worker, Peer& peer, Delivery delivery);
  std::uint64_t settled_of(StudyId id) const;
  void note_rate(const ResultsStored& event, Instant now);

  // service_writes.cpp
  void write(Change change, Write meaning, bool answer_failure);
  void write_results(const StoreResults& effect, protocol::Results& message, Instant now);
  void write_failure(const StoreFailure& effect, Instant now);
  void stored(const Write& meaning, Instant now);
  void refused(const Write& meaning, const std::string& error);
  void lose_storage(const std::string& error, Instant now);

  ServiceSettings settings_;
  Outbox& outbox_;
  Scheduler scheduler_;
  std::map<WorkerId, Peer> peers_;
  std::map<std::string, WorkerId, std::less<>> worker_ids_;  // by identity
  StudyStates studies_;
  std::map<StudyId, std::vector<Client>> submitters_;  // wait for the study to be durable
  std::map<std::uint64_t, Write> writes_;              // by ticket
  std::size_t waiting_changes_ = 0;                    // writes that a client waits for
  std::map<std::uint64_t, Query> queries_;             // by ticket
  std::vector<Event> found_;        // while effects were carried out: workers gone or busy
  std::size_t unstored_bytes_ = 0;  // of all workers' results
  bool disk_is_behind_ = false;
  std::map<std::uint64_t, LongRequest> long_requests_;  // by ticket
  SettledRates rates_;
  NoteRate worker_notes_;
  std::uint64_t last_ticket_ = 0;
  std::uint64_t bad_frames_ = 0;
  std::uint64_t refused_workers_ = 0;
  std::string storage_fault_;  // why the database takes no results; empty: it does
  bool storage_is_gone_ = false;
  bool stopping_ = false;
};

/// What to say of a name that no study has.
std::string unknown_study(const std::string& name);

/// UTC in ISO 8601 with milliseconds.
std::string iso_8601(Instant now);

}  // namespace oblique::server
