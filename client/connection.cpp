#include "client/connection.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "proto/address.h"
#include "proto/frames.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

std::string seconds_of(std::int64_t milliseconds) {
  return shown_number(static_cast<double>(milliseconds) / 1000.0) + " s";
}

}  // namespace

Connection::Connection(ConnectionSettings settings, KeepWaiting keep_waiting)
    : settings_(std::move(settings)),
      keep_waiting_(std::move(keep_waiting)),
      socket_(context_, zmq::socket_type::dealer) {
  // A request that was not sent yet must not hold up the end of the program.
  socket_.set(zmq::sockopt::linger, 0);
  socket_.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(protocol::kMaxFrameBytes));
  // The embedded service may be connected to before it listens.
  socket_.set(zmq::sockopt::reconnect_ivl, 20);
  socket_.set(zmq::sockopt::reconnect_ivl_max, 1000);
  if (const auto objection = protocol::objection_to_address(settings_.server_url);
      !objection.empty()) {
    throw solver::InputError("server = \"" + settings_.server_url + "\" is not an address: " +
                             objection + ", as in " + ConnectionSettings().server_url);
  }
  try {
    socket_.connect(settings_.server_url);
  } catch (const zmq::error_t&) {
    throw solver::InputError("server = \"" + settings_.server_url +
                             "\" is not an address: write tcp://HOST:PORT, as " +
                             ConnectionSettings().server_url);
  }
}

bool Connection::wait_for_frame(Clock::time_point deadline) {
  constexpr std::chrono::milliseconds kSlice{50};
  while (Clock::now() < deadline) {
    if (keep_waiting_ && !keep_waiting_()) {
      throw Interrupted("stopped while waiting for the server");
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
    try {
      if (zmq::poll(&item, 1, std::clamp(left, std::chrono::milliseconds{0}, kSlice)) > 0) {
        return true;
      }
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) {
        throw;
      }
    }
  }
  return false;
}

protocol::ClientReply Connection::call(protocol::ClientRequest request) {
  request.set_protocol_version(protocol::kProtocolVersion);
  request.set_request_id(++last_request_id_);
  const auto frame = protocol::encode(request);
  if (frame.size() > protocol::kMaxFrameBytes) {
    throw ConnectionError("the request has " + std::to_string(frame.size()) +
                          " bytes, more than the " + std::to_string(protocol::kMaxFrameBytes) +
                          " that a server takes: write long lists of values as ranges");
  }
  const auto deadline = Clock::now() + std::chrono::milliseconds(settings_.timeout_ms);
  socket_.send(zmq::buffer(frame), zmq::send_flags::dontwait);
  while (wait_for_frame(deadline)) {
    zmq::message_t answer;
    if (!socket_.recv(answer, zmq::recv_flags::dontwait)) {
      continue;
    }
    protocol::ClientReply reply;
    if (!protocol::decode(answer.to_string_view(), reply)) {
      throw ConnectionError("what answers at " + settings_.server_url +
                            " does not speak as oblique-server does: check the address and port");
    }
    // An answer that came after its time was given up belongs to nobody.
    if (reply.request_id() != last_request_id_ && reply.request_id() != 0) {
      continue;
    }
    if (reply.has_error()) {
      throw ServerError(reply.error().message());
    }
    // A reply has the number of its request's kind. Other programs' frames may be read as anything.
    if (static_cast<int>(reply.kind_case()) != static_cast<int>(request.kind_case())) {
      throw ConnectionError("what answers at " + settings_.server_url +
                            " does not speak as oblique-server does to clients: check the "
                            "address and port (" +
                            ConnectionSettings().server_url +
                            " is for clients; the port for workers is another one)");
    }
    return reply;
  }
  throw ConnectionError("no answer from " + settings_.server_url + " within " +
                        seconds_of(settings_.timeout_ms) +
                        ": is a server running there? Start one with `oblique-server`, or say "
                        "where it is with --server URL or OBLIQUE_SERVER");
}

protocol::SubmitReply Connection::submit(const Study& study, const StudyTerms& terms) {
  protocol::ClientRequest request;
  request.mutable_submit()->set_name(study.name);
  *request.mutable_submit()->mutable_recipe() = study.recipe;
  if (terms.priority) {
    request.mutable_submit()->set_priority(*terms.priority);
  }
  if (terms.weight) {
    request.mutable_submit()->set_weight(*terms.weight);
  }
  if (terms.mixes_versions) {
    request.mutable_submit()->set_mixes_versions(true);
  }
  return call(std::move(request)).submit();
}

protocol::StatusReply Connection::status(const std::string& study) {
  protocol::ClientRequest request;
  request.mutable_status()->set_study(study);
  return call(std::move(request)).status();
}

protocol::WorkersReply Connection::workers() {
  protocol::ClientRequest request;
  request.mutable_workers();
  return call(std::move(request)).workers();
}

protocol::ChangeReply Connection::change(const std::string& study, protocol::StudyChange change) {
  protocol::ClientRequest request;
  request.mutable_change()->set_study(study);
  request.mutable_change()->set_change(change);
  return call(std::move(request)).change();
}

protocol::QueryReply Connection::query(const std::string& sql, std::uint64_t max_rows) {
  protocol::ClientRequest request;
  request.mutable_query()->set_sql(sql);
  request.mutable_query()->set_max_rows(max_rows);
  return call(std::move(request)).query();
}

}  // namespace oblique::client
