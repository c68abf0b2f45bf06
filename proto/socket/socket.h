#pragma once

#include <optional>
#include <string>

#include <zmq.hpp>

#include "proto/keys/key_file.h"

namespace oblique::protocol {

/// What differs between the sockets of workers and clients.
struct DealerSettings {
  std::string url;             ///< as tcp://127.0.0.1:7600
  std::string example_url;     ///< what an address looks like, for messages
  int linger_ms = 0;           ///< what is not sent yet is still sent for so long after closing
  int shortest_pause_ms = 20;  ///< between attempts to connect
  int longest_pause_ms = 1000;
  bool queues_unconnected = true;  ///< takes messages while there is no connection
  bool is_worker = false;  ///< it connects to the port for workers, else to that for clients
  /// Its key, with the server's: all is encrypted, and only that server is spoken with. None: plain
  /// text with a server that has no keys.
  std::optional<KeyFile> key = {};
};

/// A DEALER socket with the options that all our sockets have (limits.h, the largest frame), which
/// does not connect yet. Throws solver::InputError for a `url` that is no address, and for a key
/// that is a server's.
zmq::socket_t made_dealer(zmq::context_t& context, const DealerSettings& settings);

/// Lets it connect, in the background, and again whenever a connection ends; a host's name is
/// looked up each time. A name may have addresses of both families, of which the server need not
/// listen on both, and each `attempt` tries the other one: IPv4 first. Throws solver::InputError as
/// above.
void connect(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt = 0);

/// Ends the connection, with what it has not delivered yet, and connects anew: for one over which
/// nothing comes any more, though neither end was told so.
void connect_again(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt);

}  // namespace oblique::protocol
