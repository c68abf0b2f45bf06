#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace oblique::simulation {

/// Thrown if a simulated program did something that must not happen.
class Violation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The clock, the random numbers and the list of future events. All depend only on the seed, so a
/// failing run can be repeated.
class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {}

  /// Returns the time of the steady clock.
  std::int64_t now_ms() const { return now_ms_; }
  /// Returns the time of the system clock, which may jump.
  std::int64_t utc_ms() const { return utc_at_zero_ms_ + now_ms_; }
  void set_clock(std::int64_t forward_ms) { utc_at_zero_ms_ += forward_ms; }

  void after(std::int64_t delay_ms, std::function<void()> what) {
    to_come_.emplace(std::pair{now_ms_ + delay_ms, next_++}, std::move(what));
  }

  /// Runs future events until `until_ms` or until `done` returns true; calls `checks` after each
  /// event.
  void run(std::int64_t until_ms, const std::function<bool()>& done,
           const std::function<void()>& checks) {
    while (!to_come_.empty() && to_come_.begin()->first.first <= until_ms && !done()) {
      auto event = to_come_.extract(to_come_.begin());
      now_ms_ = event.key().first;
      event.mapped()();
      checks();
    }
  }

  bool chance(double probability) {
    return static_cast<double>(random_() >> 11U) * 0x1p-53 < probability;
  }
  /// Returns a random integer from `low` to `high`, both inclusive.
  std::int64_t between(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
  }

  /// True while faults happen.
  bool faults = true;

 private:
  std::mt19937_64 random_;
  std::int64_t now_ms_ = 1'000'000;
  std::int64_t utc_at_zero_ms_ = 1'700'000'000'000;
  std::uint64_t next_ = 0;
  std::map<std::pair<std::int64_t, std::uint64_t>, std::function<void()>> to_come_;
};

/// Simulated ZeroMQ sockets over TCP. Until a connection breaks, its messages arrive complete and
/// in order. A break loses all messages in transit, and the peer reconnects with another identity.
/// A half-open connection loses messages before it breaks. A partition separates several peers from
/// the server. Their messages wait, because TCP repeats them, until the partition ends or the
/// connections break. A sender may allow that a message is duplicated or reordered.
class Network {
 public:
  using ToServer = std::function<void(const std::string& identity, const std::string& frame)>;
  using ToPeer = std::function<void(const std::string& frame)>;
  using LinkId = std::uint64_t;

  Network(World& world, ToServer to_server) : world_(world), to_server_(std::move(to_server)) {}

  /// Opens a new socket of `peer`; `to_peer` receives the server's messages.
  LinkId open(std::uint64_t peer, ToPeer to_peer) {
    const LinkId id = ++last_link_;
    links_.emplace(id, Link{new_identity(id), peer, std::move(to_peer), 0, 0, false, false, 0});
    if (world_.faults && world_.chance(0.2)) {
      const std::int64_t life_ms = world_.between(500, 20'000);
      world_.after(life_ms, [this, id] { cut(id); });
    }
    return id;
  }

  /// Closes the socket. Messages to it are lost. Messages that it sent arrive only if `linger` is
  /// true.
  void close(LinkId id, bool linger) {
    links_.erase(id);
    if (!linger) {
      silenced_.insert(id);
    }
  }

  /// Sends `frame` to the server. If `loosely` is true, `frame` may be duplicated or reordered.
  void send(LinkId id, const std::string& frame, bool loosely) {
    const auto found = links_.find(id);
    if (found == links_.end() || found->second.cut_up) {
      return;
    }
    Link& link = found->second;
    wait_for_partition(link);
    const std::string identity = link.identity;
    const auto deliver = [this, identity, frame, breaks = link.breaks, id] {
      const auto there = links_.find(id);
      const bool closed = there == links_.end();
      if (closed ? !silenced_.contains(id) : there->second.breaks == breaks) {
        to_server_(identity, frame);
      }
    };
    if (loosely && world_.faults && world_.chance(0.05)) {
      world_.after(delay_ms() + world_.between(0, 300), deliver);
      if (world_.chance(0.5)) {
        return;  // only reordered
      }
    }
    link.last_up_ms = std::max(link.last_up_ms, world_.now_ms() + delay_ms());
    world_.after(link.last_up_ms - world_.now_ms(), deliver);
  }

  /// Sends `frame` to a peer. Returns false if no connection has this identity.
  bool send_to(const std::string& identity, const std::string& frame) {
    const LinkId id = link_of(identity);
    const auto found = links_.find(id);
    if (found == links_.end()) {
      return false;
    }
    Link& link = found->second;
    if (link.cut_down) {
      return true;  // the server has not noticed the break yet
    }
    wait_for_partition(link);
    link.last_down_ms = std::max(link.last_down_ms, world_.now_ms() + delay_ms());
    world_.after(link.last_down_ms - world_.now_ms(), [this, id, frame, breaks = link.breaks] {
      const auto there = links_.find(id);
      if (there != links_.end() && there->second.breaks == breaks) {
        there->second.to_peer(frame);
      }
    });
    return true;
  }

  /// Separates `peers` from the server for `duration_ms`. Connections that stall too long break.
  void part(std::set<std::uint64_t> peers, std::int64_t duration_ms) {
    parted_ = std::move(peers);
    parted_until_ms_ = world_.now_ms() + duration_ms;
    world_.after(std::min(duration_ms, kPatience_ms), [this, until_ms = parted_until_ms_] {
      for (auto& [id, link] : links_) {
        if (until_ms == parted_until_ms_ && world_.now_ms() < until_ms &&
            parted_.contains(link.peer)) {
          break_link(id, link);
        }
      }
    });
  }

  /// Breaks the connections of `peer`. Without `peer` breaks all connections, as when the server
  /// dies. The sockets then reconnect.
  void break_links(std::optional<std::uint64_t> peer = std::nullopt) {
    for (auto& [id, link] : links_) {
      if (!peer || link.peer == *peer) {
        break_link(id, link);
      }
    }
  }

  void heal() {
    parted_until_ms_ = 0;
    for (auto& [id, link] : links_) {
      if (link.cut_up || link.cut_down || parted_.contains(link.peer)) {
        break_link(id, link);
      }
    }
  }

  LinkId link_of(const std::string& identity) const {
    const auto found = identities_.find(identity);
    return found == identities_.end() ? 0 : found->second;
  }

 private:
  /// A connection breaks after this time without input.
  static constexpr std::int64_t kPatience_ms = 10'000;

  struct Link {
    std::string identity;
    std::uint64_t peer;
    ToPeer to_peer;
    std::int64_t last_up_ms;
    std::int64_t last_down_ms;
    bool cut_up;
    bool cut_down;
    std::uint64_t breaks;  // number of breaks; messages sent before a break are lost
  };

  std::string new_identity(LinkId id) {
    std::string identity = "peer " + std::to_string(++last_identity_);
    identities_[identity] = id;
    return identity;
  }

  std::int64_t delay_ms() {
    return world_.faults && world_.chance(0.01) ? world_.between(50, 3000) : world_.between(0, 3);
  }

  void wait_for_partition(Link& link) {
    if (parted_until_ms_ > world_.now_ms() && parted_.contains(link.peer)) {
      link.last_up_ms = std::max(link.last_up_ms, parted_until_ms_);
      link.last_down_ms = std::max(link.last_down_ms, parted_until_ms_);
    }
  }

  void cut(LinkId id) {
    const auto found = links_.find(id);
    if (found == links_.end()) {
      return;
    }
    found->second.cut_up = world_.chance(0.7);
    found->second.cut_down = !found->second.cut_up || world_.chance(0.5);
    world_.after(world_.between(0, 8000), [this, id] {
      const auto there = links_.find(id);
      if (there != links_.end()) {
        break_link(id, there->second);
      }
    });
  }

  void break_link(LinkId id, Link& link) {
    ++link.breaks;
    identities_.erase(link.identity);
    link.identity = new_identity(id);
    link.cut_up = false;
    link.cut_down = false;
    link.last_up_ms = 0;
    link.last_down_ms = 0;
  }

  World& world_;
  ToServer to_server_;
  std::map<LinkId, Link> links_;
  std::map<std::string, LinkId> identities_;
  std::set<LinkId> silenced_;       // closed sockets whose messages are lost
  std::set<std::uint64_t> parted_;  // peers separated by the partition
  std::int64_t parted_until_ms_ = 0;
  LinkId last_link_ = 0;
  std::uint64_t last_identity_ = 0;
};

}  // namespace oblique::simulation
