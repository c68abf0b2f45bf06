#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "server/network/curve/doorkeeper.h"
#include "server/network/curve/handshake.h"
#include "server/network/curve/traffic.h"

namespace oblique::server {

/// The server's end of CURVE with one peer: who it is, and what both say then.
class CurvePeer {
 public:
  /// `guard` must outlive this.
  explicit CurvePeer(const PortGuard& guard) : guard_(guard) {}

  /// What the peer is told, or its properties; or why it is refused.
  using Outcome = std::variant<std::string, Refusal>;
  /// Takes a command of the handshake, its data without its name: HELLO first and INITIATE second,
  /// each once. Gives the data of WELCOME, or INITIATE's properties, with which the peer is
  /// admitted. Costs about 0.1 ms either time.
  Outcome take(std::string_view command, std::string_view data);
  /// INITIATE was taken, and the peer has proved who it is.
  bool is_admitted() const { return traffic_.has_value(); }

  // Only of one that is admitted.
  const std::shared_ptr<const KeyHolder>& holder() const { return holder_; }
  const protocol::CurveKey& key() const { return key_; }
  CurveTraffic& traffic() { return *traffic_; }

 private:
  Outcome take_hello(std::string_view hello);
  Outcome take_initiate(std::string_view initiate);

  const PortGuard& guard_;
  std::optional<CurveHandshake> handshake_;
  std::shared_ptr<const KeyHolder> holder_;
  protocol::CurveKey key_{};
  std::optional<CurveTraffic> traffic_;
};

/// What ERROR tells a peer that is refused: "400" that its key is not admitted, "500" that it has
/// a wrong key of the server or does not speak the protocol, "300" that it may try later. Sockets
/// of libzmq 4.3.4 report these three to their programs, and nothing longer.
std::string_view error_code(RefusalCause cause);

}  // namespace oblique::server
