#pragma once

namespace oblique::server {

/// What became of a message to a peer.
enum class Delivery {
  kSent,  ///< it is on its way
  kBusy,  ///< the same, but so much waits to go out that the peer should get no further work yet
  kGone,  ///< there is no such peer any more
};

}  // namespace oblique::server
