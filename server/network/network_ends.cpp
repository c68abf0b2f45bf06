// How connections end.
#include <algorithm>
#include <string>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "server/network/network.h"

namespace oblique::server {

/// The system has nothing more of this peer than what can be read at once.
void Network::read_to_the_end(Number number, Peer& peer) {
  const Zmtp& said = peer.connection.said();
  while (!said.has_message() && said.waiting_work() == Zmtp::Work::kNone) {
    if (!said.fault().empty() || peer.connection.read() != Connection::Read::kBytes) {
      end(number, said.fault());
      return;
    }
  }
  settle(number, peer);
}

void Network::count_refusal(RefusalCause cause, const std::string& address,
                            const std::string& reason) {
  RefusalCount& refusal = refusals_.at(static_cast<std::size_t>(cause));
  ++refusal.count;
  refusal.last_address = address;
  refusal.last_reason = reason;
}

void Network::depart(Number number, Peer& peer, const std::string& reason,
                     std::optional<RefusalCause> refused) {
  if (std::exchange(peer.has_departed, true)) {
    return;
  }
  const std::string address = reason.empty() ? "" : peer.address.text();
  if (refused) {
    count_refusal(*refused, address, reason);
  }
  departures_.push_back({std::to_string(number), reason, refused, address});
}

void Network::end(Number number, const std::string& reason, std::optional<RefusalCause> cause) {
  const auto found = peers_.find(number);
  Peer& peer = *found->second;
  depart(number, peer, reason, cause);
  count(peer, 0, 0);
  if (peer.share != nullptr) {
    shares_.leave(peer.connection.said().key());
  }
  handshake_is_over(number, peer);
  peers_.erase(found);
}

void Network::handshake_is_over(Number number, Peer& peer) {
  if (std::exchange(peer.is_stranger, false)) {
    strangers_.erase(number);
    const auto of_source = strangers_of_.find(peer.address.source());
    of_source->second.erase(number);
    if (of_source->second.empty()) {
      strangers_of_.erase(of_source);
    }
  }
}

void Network::end_faulty(Number number, const Peer& peer) {
  const Zmtp& said = peer.connection.said();
  end(number, said.fault(), peer.is_stranger ? std::optional(said.cause()) : std::nullopt);
}

/// A peer that finds another mechanism in the server's greeting than its own leaves without a word,
/// often in the middle of its own greeting.
void Network::end_who_has_left(Number number, const Peer& peer) {
  if (peer.connection.said().is_greeting()) {
    end(number,
        "it left at the server's greeting, as peers do that have no key where one is needed, or "
        "one where none is",
        RefusalCause::kOtherMechanism);
  } else {
    end(number, "");
  }
}

std::vector<Departure> Network::take_departures() {
  return std::exchange(departures_, {});
}

void Network::end_the_largest() {
  const auto end_largest = [&](std::size_t Peer::*bytes, const char* reason) {
    const auto largest =
        std::max_element(peers_.begin(), peers_.end(), [&](const auto& left, const auto& right) {
          return (*left.second).*bytes < (*right.second).*bytes;
        });
    end(largest->first, reason);
  };
  while (held_in_bytes_ > limits_.held_in_bytes) {
    end_largest(&Peer::held_in_bytes, "all connections together hold too much, and it holds most");
  }
  while (waiting_out_bytes_ > limits_.all_waiting_out_bytes) {
    end_largest(&Peer::waiting_out_bytes,
                "all connections together leave too much unread, and it leaves most");
  }
  if (std::exchange(a_key_has_too_much_, false)) {
    end_the_largest_of_keys();
  }
}

void Network::end_the_largest_of_keys() {
  const auto end_largest = [&](const KeyShare& share, std::size_t Peer::*bytes, const char* what) {
    Number largest = 0;
    std::size_t most = 0;
    for (const auto& [number, peer] : peers_) {
      if (peer->share == &share && (*peer).*bytes >= most) {
        largest = number;
        most = (*peer).*bytes;
      }
    }
    end(largest,
        fmt::format("all connections of the key \"{}\" together {}, and it most",
                    share.holder->name, what),
        RefusalCause::kBound);
  };
  // Who has ended may have been the last one of its key.
  for (bool has_ended = true; has_ended;) {
    has_ended = false;
    for (const auto& [key, share] : shares_.all()) {
      if (share.held_in_bytes > limits_.held_in_bytes_of_key) {
        end_largest(share, &Peer::held_in_bytes, "hold too much");
        has_ended = true;
        break;
      }
      if (share.waiting_out_bytes > limits_.waiting_out_bytes_of_key) {
        end_largest(share, &Peer::waiting_out_bytes, "leave too much unread");
        has_ended = true;
        break;
      }
    }
  }
}

/// False when none is under way.
bool Network::end_oldest_handshake() {
  if (strangers_.empty()) {
    return false;
  }
  end(*strangers_.begin(),
      "there is no room for more, and its handshake is the oldest that is not done",
      RefusalCause::kBound);
  return true;
}

void Network::end_unfinished_handshakes(std::int64_t now_ms) {
  while (!strangers_.empty() &&
         now_ms - peers_.at(*strangers_.begin())->since_ms > limits_.handshake_ms) {
    end(*strangers_.begin(), "it does not finish its handshake", RefusalCause::kTooSlow);
  }
}

void Network::admission_changed() {
  std::vector<std::pair<Number, Refusal>> refused;
  for (const auto& [number, peer] : peers_) {
    if (peer->share == nullptr) {
      continue;
    }
    Verdict verdict = ports_[peer->port].doorkeeper->judge(peer->connection.said().key());
    if (auto* const refusal = std::get_if<Refusal>(&verdict)) {
      refused.emplace_back(number, std::move(*refusal));
    } else {
      peer->holder = std::get<std::shared_ptr<const KeyHolder>>(std::move(verdict));
      peer->share->holder = peer->holder;
    }
  }
  for (const auto& [number, refusal] : refused) {
    const bool was_removed = refusal.cause == RefusalCause::kUnknownKey;
    end(number, refusal.reason, was_removed ? RefusalCause::kRevokedKey : refusal.cause);
  }
}

}  // namespace oblique::server
