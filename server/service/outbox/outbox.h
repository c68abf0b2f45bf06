#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/network/authenticator.h"
#include "server/network/delivery.h"
#include "server/query/query_pool.h"
#include "server/service/outbox/request_reader.h"
#include "server/store/writer.h"

// What the service asks of the world around it, by whom it asks it. Nothing here may block or call
// the service back.
namespace oblique::server {

/// A moment by two clocks.
struct Instant {
  std::int64_t steady_ms;  ///< never runs backwards
  std::int64_t utc_ms;     ///< since 1970
};

/// UTC in ISO 8601 with milliseconds.
std::string iso_8601(Instant now);

/// Who waits for a reply.
struct Client {
  std::string identity;
  std::uint64_t request_id;
  std::shared_ptr<const KeyHolder> holder = {};  ///< null: there are no keys

  /// Name of its key; empty: without keys.
  std::string key() const { return holder == nullptr ? std::string() : holder->name; }
  bool is_reader() const { return holder != nullptr && holder->role == protocol::Role::kReader; }

  bool operator==(const Client&) const = default;
};

class ToWorkers {
 public:
  virtual ~ToWorkers() = default;
  virtual Delivery to_worker(const std::string& identity,
                             const protocol::ServerToWorker& message) = 0;
  /// The same for a message that is encoded already.
  virtual Delivery forward_to_worker(const std::string& identity, const std::string& frame) = 0;
  /// More waits to go out to that worker than should.
  virtual bool is_busy(const std::string& identity) const = 0;
  /// Something has come from that worker that was not taken yet.
  virtual bool has_unheard(const std::string& /*identity*/) const { return false; }
};

class ToClients {
 public:
  virtual ~ToClients() = default;
  /// False when the client is gone; the reply is dropped then: it asks again.
  virtual bool to_client(const std::string& identity, const protocol::ClientReply& reply) = 0;
  /// The same for a reply that is encoded already.
  virtual bool forward_to_client(const std::string& identity, const std::string& frame) = 0;

  /// The client's request failed, for this reason.
  void reply_error(const Client& client, const std::string& message);
};

/// Who was turned away.
struct PeerCounts {
  std::vector<std::pair<std::string, std::uint64_t>> refusals{};  ///< causes with how many peers
};

class ToNetwork {
 public:
  virtual ~ToNetwork() = default;
  virtual PeerCounts peer_counts() const { return {}; }
};

class ToWriter {
 public:
  virtual ~ToWriter() = default;
  /// `Service::written` is called once the job's fate is known.
  virtual void write(WriteJob job) = 0;
};

class ToReaders {
 public:
  virtual ~ToReaders() = default;
  /// `Service::queried` is called with the answer. False when too many queries wait.
  virtual bool query(QueryJob job) = 0;
  /// The client of an answer in chunks has taken so many of them.
  virtual void more_rows(std::uint64_t ticket, std::uint64_t taken) = 0;
  /// Nobody waits for that query any more.
  virtual void cancel_query(std::uint64_t ticket) = 0;
  /// `Service::request_read` is called with what the frame says.
  virtual void read(ReadJob job) = 0;
  /// Nobody waits for that report any more.
  virtual void cancel_read(std::uint64_t /*ticket*/) {}
};

enum class Severity { kInfo, kWarning, kError };

class ToLog {
 public:
  virtual ~ToLog() = default;
  virtual void note(Severity severity, const std::string& text) = 0;
};

/// All of them; the loop is one, and tests put theirs in its place.
class Outbox : public ToWorkers,
               public ToClients,
               public ToWriter,
               public ToReaders,
               public ToNetwork,
               public ToLog {};

}  // namespace oblique::server
