#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "proto/system/descriptor.h"
#include "server/study/limits.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// A limited number of slots, for example for concurrent requests. Must outlive all slots.
class Slots {
 public:
  explicit Slots(std::size_t count) : free_(count) {}
  /// Takes a slot. The slot is free again when the last copy of the returned pointer is destroyed.
  /// Returns null if no slot is free.
  std::shared_ptr<const void> take() {
    if (free_ == 0) {
      return nullptr;
    }
    --free_;
    return {this, [](Slots* slots) { ++slots->free_; }};
  }

 private:
  std::size_t free_;
};

/// The recipes of the last few requested studies.
class RecipeCache {
 public:
  using Table = std::shared_ptr<const protocol::PointTable>;

  /// Returns null if the recipe is not in the cache or the study has grown since.
  Table find(std::uint64_t study, std::uint64_t points) const;
  void put(std::uint64_t study, Table table);

 private:
  std::deque<std::pair<std::uint64_t, Table>> kept_;  // the latest first
};

/// Lets the HTTP thread use the service like a client: passes requests and replies between threads.
class ServiceClient {
 public:
  /// The identity of this client in the service. No connection has this identity.
  static constexpr const char* kIdentity = "the page";

  // ---- Called by the HTTP server's thread.
  // Returns a new request number. Requests of browsers never have such a number.
  std::uint64_t new_number() { return ++last_number_; }
  void ask(std::uint64_t number, protocol::ClientRequest request);
  /// Returns the next reply to request `number`, if one has arrived.
  std::optional<protocol::ClientReply> reply(std::uint64_t number);
  /// Drops further replies to request `number` and ends its query or trace.
  void forget(std::uint64_t number);
  RecipeCache& recipes() { return recipes_; }
  /// Return slots for requests whose replies need much memory.
  Slots& recipe_slots() { return recipe_slots_; }
  Slots& trace_slots() { return trace_slots_; }

  // Returns a descriptor that becomes readable when there are requests to take.
  int descriptor() const { return woken_.descriptor(); }
  /// Takes some of the waiting requests, encoded as ClientRequest.
  std::vector<std::string> take();
  /// Adds a reply, encoded as ClientReply.
  void put(std::string frame);

 private:
  struct Awaited {
    bool may_end = false;  ///< true for a query or trace whose last reply has not arrived
    std::deque<protocol::ClientReply> replies = {};
  };

  void decode_frames();
  void send(protocol::ClientRequest request);

  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::deque<std::string> requests_;  // guarded by mutex_
  std::vector<std::string> frames_;   // guarded by mutex_
  // The members below are used only by the HTTP server's thread.
  std::uint64_t last_number_ = std::uint64_t{1} << 63U;
  std::map<std::uint64_t, Awaited> awaited_;
  RecipeCache recipes_;
  Slots recipe_slots_{limits::kRecipesOfPage};
  Slots trace_slots_{limits::kTracesOfPage};
};

/// Sends requests to the service one after another. Each request has a new number, because a late
/// error about the previous request may follow. Only a request for more rows keeps the number. The
/// destructor ends the running request.
class ServiceExchange {
 public:
  explicit ServiceExchange(ServiceClient& service) : service_(service) {}
  ~ServiceExchange() { service_.forget(number_); }
  ServiceExchange(const ServiceExchange&) = delete;
  ServiceExchange& operator=(const ServiceExchange&) = delete;

  void send(const protocol::ClientRequest& request) {
    service_.forget(number_);
    number_ = service_.new_number();
    chunks_ = 0;
    service_.ask(number_, request);
  }
  /// Requests more rows by confirming one more chunk of the answer.
  void request_more_rows() {
    protocol::ClientRequest more;
    more.mutable_more_rows()->set_request_id(number_);
    more.mutable_more_rows()->set_received(++chunks_);
    service_.ask(number_, more);
  }
  /// Returns the next reply, if one has arrived.
  std::optional<protocol::ClientReply> reply() { return service_.reply(number_); }

 private:
  ServiceClient& service_;
  std::uint64_t number_ = 0;
  std::uint64_t chunks_ = 0;
};

/// Returns the HTTP answer for an error of the service. It omits the name of an unknown study.
HttpAnswer failure(const protocol::ErrorReply& error);

}  // namespace oblique::server
