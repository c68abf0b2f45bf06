#pragma once

#include <string>

namespace oblique::protocol {

struct DealerSettings;

/// Why the other end ended a handshake with one of our sockets.
enum class Rejection {
  kKey,             ///< it does not admit our key at this port
  kServersKey,      ///< our file has another public key of the server than it has itself
  kOtherMechanism,  ///< it asks for keys and we have none, or the other way round
  kForNow,          ///< it has no room at present
  kNoServer,        ///< it does not speak as a server of ours
};

/// For people: who turned whom away, why, and what to do; without a full stop.
std::string sentence_of(Rejection rejection, const DealerSettings& settings);

}  // namespace oblique::protocol
