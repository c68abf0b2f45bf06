#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "proto/oblique.pb.h"

namespace oblique::worker {

/// How much of what is solved is kept and sent.
struct OutboxLimits {
  /// With so many results not acknowledged, or so many bytes of them, no more are solved.
  std::size_t unacknowledged_results = 50'000;
  std::size_t unacknowledged_bytes = std::size_t{64} << 20U;
  /// Of those, so many messages and bytes are on their way at a time; the others wait here, so that
  /// what was solved while the server was away does not come upon it all at once.
  std::size_t messages_on_their_way = 256;
  std::size_t bytes_on_their_way = std::size_t{8} << 20U;
};

/// Results that the server has not acknowledged, in the order of their sequence numbers: those on
/// their way, then those that wait.
class Outbox {
 public:
  explicit Outbox(const OutboxLimits& limits) : limits_(limits) {}

  /// Gives the results the next sequence number and keeps them.
  void add(protocol::Results results);
  /// The next results to send, which are on their way from now on; nothing while none waits or
  /// enough are on their way.
  const protocol::Results* next_to_send();
  /// The server has them. A number that is not kept is passed over.
  void acknowledged(std::uint64_t sequence);
  void drop_study(std::uint64_t study_id);
  void drop_all();
  /// Nothing is on its way any more, nor does any lease end with these results.
  void start_over();

  bool is_empty() const { return unacknowledged_.empty(); }
  /// Whether any results are not even on their way.
  bool has_waiting() const { return on_their_way_ < unacknowledged_.size(); }
  bool is_full() const {
    return results_ >= limits_.unacknowledged_results || bytes_ >= limits_.unacknowledged_bytes;
  }
  std::size_t results() const { return results_; }
  /// Calls `see` with all that are kept.
  template <class See>
  void for_each(const See& see) const {
    for (const Message& message : unacknowledged_) {
      see(message.results);
    }
  }

 private:
  struct Message {
    protocol::Results results;
    std::size_t bytes;
    bool on_its_way;  ///< sent in this session
  };
  void forget(const Message& message);

  const OutboxLimits limits_;
  std::deque<Message> unacknowledged_;
  std::size_t results_ = 0;
  std::size_t bytes_ = 0;
  std::size_t on_their_way_ = 0;        // messages
  std::size_t bytes_on_their_way_ = 0;  // of those
  std::uint64_t next_sequence_ = 1;
};

}  // namespace oblique::worker
