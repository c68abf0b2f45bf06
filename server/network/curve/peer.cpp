#include "server/network/curve/peer.h"

#include <utility>

namespace oblique::server {

CurvePeer::Outcome CurvePeer::take(std::string_view command, std::string_view data) {
  if (command == "HELLO" && !handshake_) {
    return take_hello(data);
  }
  if (command == "INITIATE" && handshake_) {
    Outcome outcome = take_initiate(data);
    handshake_.reset();
    return outcome;
  }
  return Refusal{RefusalCause::kFaulty,
                 handshake_ ? "it does not say INITIATE" : "it does not say HELLO"};
}

CurvePeer::Outcome CurvePeer::take_hello(std::string_view hello) {
  if (!CurveHandshake::is_sound_hello(hello)) {
    return Refusal{RefusalCause::kFaulty, "its HELLO is none of CURVE 1.0"};
  }
  std::optional<std::string> welcome = handshake_.emplace().welcome(guard_.server_secret, hello);
  if (!welcome) {
    handshake_.reset();
    return Refusal{RefusalCause::kWrongServerKey, "it has another public key of the server"};
  }
  return *std::move(welcome);
}

CurvePeer::Outcome CurvePeer::take_initiate(std::string_view initiate) {
  std::optional<Claim> claim = handshake_->claim(initiate);
  if (!claim) {
    return Refusal{RefusalCause::kFaulty, "its INITIATE does not belong to its HELLO"};
  }
  // Before the key is judged: a forged INITIATE must not reveal which keys are listed.
  if (!handshake_->is_proved(guard_.server_public)) {
    return Refusal{RefusalCause::kFaulty, "it does not hold the key that it shows"};
  }
  Verdict verdict = guard_.doorkeeper->judge(claim->client_key);
  if (auto* const refusal = std::get_if<Refusal>(&verdict)) {
    return std::move(*refusal);
  }
  key_ = claim->client_key;
  holder_ = std::get<std::shared_ptr<const KeyHolder>>(std::move(verdict));
  if (!holder_) {
    return Refusal{RefusalCause::kUnknownKey, "nobody says whose key it has"};
  }
  traffic_ = handshake_->traffic();
  return std::move(claim->metadata);
}

std::string_view error_code(RefusalCause cause) {
  switch (cause) {
    case RefusalCause::kUnknownKey:
    case RefusalCause::kRevokedKey:
    case RefusalCause::kOtherRole:
      return "400";
    case RefusalCause::kBound:
    case RefusalCause::kTooSlow:
      return "300";
    default:
      return "500";
  }
}

}  // namespace oblique::server
