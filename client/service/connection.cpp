#include "client/service/connection.h"

#include <algorithm>
#include <array>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/address.h"
#include "proto/frames.h"
#include "proto/socket/socket.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

/// A server that says nothing for so long is away.
constexpr std::chrono::milliseconds kSilence{3'000};

std::string seconds_of(std::chrono::milliseconds time) {
  return fmt::format("{} s", solver::exact_number(static_cast<double>(time.count()) / 1000.0));
}

/// A request that was not sent yet must not hold up the end of the program. Nothing is queued for a
/// server that is not there, which would get every copy when it is back. The embedded service may
/// be connected to before it listens: attempts follow each other closely.
protocol::DealerSettings dealer_settings(const ConnectionSettings& settings) {
  return {.url = settings.server_url,
          .example_url = ConnectionSettings().server_url,
          .linger_ms = 0,
          .shortest_pause_ms = 20,
          .longest_pause_ms = 1000,
          .queues_unconnected = false,
          .key = settings.key};
}

/// Why nobody may have answered, and what to do about it.
std::string guess_at_silence(const std::string& url) {
  const std::string host = protocol::host_of(url);
  const auto [has_v4, has_v6] = protocol::families_of(host);
  return host.empty() || has_v4 || has_v6
             ? "is a server running there? Start one with `oblique-server`"
             : fmt::format("no address is known here for the name {}. Check it", host);
}

/// Where the page begins that follows the one after `asked`; 0: there is none. A page that does not
/// come later than the one before would never end.
std::uint64_t next_page(std::uint64_t asked, std::uint64_t answered) {
  return answered > asked ? answered : 0;
}

}  // namespace

Connection::Connection(ConnectionSettings settings, KeepWaiting keep_waiting)
    : settings_(std::move(settings)),
      keep_waiting_(std::move(keep_waiting)),
      socket_(protocol::made_dealer(context_, dealer_settings(settings_))),
      monitor_(context_, socket_, dealer_settings(settings_)) {
  protocol::connect(socket_, dealer_settings(settings_));
}

bool Connection::is_unsent(const Outstanding& outstanding) {
  const auto connections = monitor_.connections();
  // What an earlier connection took may have been lost with it.
  return connections > 0 && outstanding.sent_over != connections;
}

void Connection::send_or_connect_again(Outstanding& outstanding) {
  const auto now = Clock::now();
  if (is_unsent(outstanding) &&
      socket_.send(zmq::buffer(outstanding.frame), zmq::send_flags::dontwait)) {
    outstanding.sent_over = monitor_.connections();
    outstanding.sent = now;
    return;
  }
  // A connection over which nothing comes may be dead, and only its ends do not know.
  const bool has_connected = monitor_.connections() > connections_before_;
  // Where nobody answers, the next attempt gets longer: on a long line a handshake takes seconds.
  const auto patience =
      has_connected ? outstanding.resend_after : kSilence * (1U << std::min(attempts_in_vain_, 2U));
  if (now - std::max(outstanding.sent, connecting_since_) <= patience) {
    return;
  }
  attempts_in_vain_ = has_connected ? 0 : attempts_in_vain_ + 1;
  if (has_connected) {
    constexpr std::chrono::milliseconds kLongestPause{60'000};
    outstanding.resend_after = std::min(2 * outstanding.resend_after, kLongestPause);
  } else {
    ++attempt_;
  }
  connections_before_ = monitor_.connections();
  connecting_since_ = now;
  protocol::connect_again(socket_, dealer_settings(settings_), attempt_);
}

void Connection::wait_a_slice(bool to_send) {
  constexpr std::chrono::milliseconds kLongest{50};
  constexpr std::int64_t kSlices = 5;  // of a short patience
  const auto slice = std::min(std::chrono::milliseconds(settings_.timeout_ms / kSlices), kLongest);
  if (keep_waiting_ && !keep_waiting_()) {
    throw Interrupted("stopped while waiting for the server");
  }
  const int events = ZMQ_POLLIN | (to_send ? ZMQ_POLLOUT : 0);
  // The monitor first: the socket, looked at after it, then knows of the same connection.
  std::array<zmq::pollitem_t, 2> items{{{monitor_.handle(), 0, ZMQ_POLLIN, 0},
                                        {socket_.handle(), 0, static_cast<short>(events), 0}}};
  try {
    zmq::poll(items, slice);
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) {
      throw;
    }
  }
}

std::optional<protocol::ClientReply> Connection::received(std::uint64_t request_id) {
  zmq::message_t answer;
  if (!socket_.recv(answer, zmq::recv_flags::dontwait)) {
    return std::nullopt;
  }
  protocol::ClientReply reply;
  if (!protocol::decode(answer.to_string_view(), reply)) {
    throw ConnectionError(fmt::format(
        "what answers at {} does not speak as oblique-server does: check the address and port",
        settings_.server_url));
  }
  // An answer that came after its time was given up, or a second one, belongs to nobody.
  const bool is_word_of_it =
      reply.has_still_working() && reply.still_working().request_id() == request_id;
  if (reply.request_id() != request_id && reply.request_id() != 0 && !is_word_of_it) {
    return std::nullopt;
  }
  return reply;
}

void Connection::note_word(Outstanding& outstanding, const protocol::StillWorking& word,
                           bool counts_as_answer) {
  const auto now = Clock::now();
  outstanding.word = now;
  outstanding.runs = word.runs();
  outstanding.sent = now;  // it has arrived
  if (counts_as_answer) {
    outstanding.heard = now;
  }
}

protocol::ClientReply Connection::answer_to(const protocol::ClientRequest& request,
                                            Outstanding outstanding, const Tell& tell) {
  const std::chrono::milliseconds timeout(settings_.timeout_ms);
  bool said_silent = false;
  while (tell || Clock::now() - outstanding.heard < timeout) {
    send_or_connect_again(outstanding);
    wait_a_slice(is_unsent(outstanding));
    if (const auto rejection = monitor_.rejection()) {
      throw ConnectionError(*rejection);
    }
    if (auto reply = received(request.request_id())) {
      if (std::exchange(said_silent, false)) {
        tell(fmt::format("{} answers again", settings_.server_url));
      }
      if (!reply->has_still_working()) {
        return *std::move(reply);
      }
      // A trace may take long, and so may the points of a study, each of which is looked at.
      const bool may_take_long = tell || request.has_trace() || request.has_submit();
      note_word(outstanding, reply->still_working(), may_take_long);
    }
    if (tell && !said_silent && Clock::now() - outstanding.heard > kSilence) {
      tell(fmt::format("no answer from {} for {}: waiting until it is back", settings_.server_url,
                       seconds_of(kSilence)));
      said_silent = true;
    }
  }
  if (outstanding.runs && Clock::now() - outstanding.word < kSilence) {
    throw ConnectionError(fmt::format(
        "the query took too long: after {} {} {} still. Narrow it, as with WHERE or LIMIT, or give "
        "it more time with --timeout SECONDS",
        seconds_of(timeout), settings_.server_url,
        *outstanding.runs ? "works on it" : "is busy with the queries of others"));
  }
  if (!settings_.if_silent.empty()) {
    throw ConnectionError(fmt::format("no answer from {} within {}: {}", settings_.server_url,
                                      seconds_of(timeout), settings_.if_silent));
  }
  throw ConnectionError(fmt::format(
      "no answer from {} within {}: {}, or say where it is with --server URL or "
      "OBLIQUE_SERVER",
      settings_.server_url, seconds_of(timeout), guess_at_silence(settings_.server_url)));
}

protocol::ClientReply Connection::call(protocol::ClientRequest request, const Tell& tell) {
  return call_numbered(request, tell);
}

protocol::ClientReply Connection::call_numbered(protocol::ClientRequest& request,
                                                const Tell& tell) {
  end_rows();
  request.set_protocol_version(protocol::kProtocolVersion);
  request.set_request_id(++last_request_id_);
  auto frame = protocol::encode(request);
  if (frame.size() > protocol::kMaxFrameBytes) {
    throw ConnectionError(
        fmt::format("the request has {} bytes, more than the {} that a server takes: write long "
                    "lists of values as ranges",
                    frame.size(), protocol::kMaxFrameBytes));
  }
  auto reply =
      answer_to(request,
                {.frame = std::move(frame),
                 .heard = Clock::now(),
                 // A trace may take long to arrive; a new connection would begin anew.
                 .resend_after = std::chrono::milliseconds(
                     request.has_trace() ? settings_.timeout_ms : settings_.resend_after_ms),
                 .sent = Clock::now()},
                tell);
  check(reply, request);
  return reply;
}

void Connection::check(const protocol::ClientReply& reply,
                       const protocol::ClientRequest& request) const {
  if (reply.has_error() && reply.error().wrong_request()) {
    throw solver::InputError(reply.error().message());
  }
  if (reply.has_error()) {
    throw ServerError(reply.error().message());
  }
  // A reply has the number of its request's kind. Other programs' frames may be read as anything.
  if (static_cast<int>(reply.kind_case()) != static_cast<int>(request.kind_case())) {
    throw ConnectionError(
        fmt::format("what answers at {} does not speak as oblique-server does to clients: check "
                    "the address and port ({} is for clients; the port for workers is another one)",
                    settings_.server_url, ConnectionSettings().server_url));
  }
}

protocol::SubmitReply Connection::submit(const Study& study, const SubmitSettings& settings) {
  protocol::ClientRequest request;
  request.mutable_submit()->set_name(study.name);
  *request.mutable_submit()->mutable_recipe() = study.recipe;
  if (settings.priority) {
    request.mutable_submit()->set_priority(*settings.priority);
  }
  request.mutable_submit()->set_no_reuse(settings.no_reuse);
  return call(std::move(request)).submit();
}

protocol::StatusReply Connection::greeting() {
  protocol::ClientRequest request;
  request.mutable_status()->set_limit(1);
  return call(std::move(request)).status();
}

protocol::StatusReply Connection::status(const std::string& study, const Tell& tell) {
  protocol::StatusReply all;
  std::uint64_t after = 0;
  do {
    protocol::ClientRequest request;
    request.mutable_status()->set_study(study);
    request.mutable_status()->set_after_study_id(after);
    const protocol::StatusReply page = call(std::move(request), tell).status();
    after = next_page(after, page.next_after());
    all.MergeFrom(page);
  } while (after != 0);
  return all;
}

protocol::StatusReply Connection::status_of(const std::string& study, std::uint64_t study_id,
                                            const Tell& tell) {
  protocol::ClientRequest request;
  request.mutable_status()->set_study(study);
  request.mutable_status()->set_study_id(study_id);
  return call(std::move(request), tell).status();
}

protocol::WorkersReply Connection::workers() {
  protocol::WorkersReply all;
  std::uint64_t after = 0;
  do {
    protocol::ClientRequest request;
    request.mutable_workers()->set_after_worker_id(after);
    const protocol::WorkersReply page = call(std::move(request)).workers();
    after = next_page(after, page.next_after());
    all.MergeFrom(page);
  } while (after != 0);
  return all;
}

protocol::TraceReply Connection::trace(protocol::TraceRequest trace) {
  protocol::ClientRequest request;
  *request.mutable_trace() = std::move(trace);
  return call(std::move(request)).trace();
}

protocol::ChangeReply Connection::change(const std::string& study, protocol::StudyChange change) {
  protocol::ClientRequest request;
  request.mutable_change()->set_study(study);
  request.mutable_change()->set_change(change);
  return call(std::move(request)).change();
}

protocol::ChangeReply Connection::rename(const protocol::StudyStatus& study,
                                         const std::string& name) {
  protocol::ClientRequest request;
  request.mutable_change()->set_study(study.name());
  request.mutable_change()->set_study_id(study.study_id());
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_RENAME);
  request.mutable_change()->set_new_name(name);
  return call(std::move(request)).change();
}

protocol::ChangeReply Connection::remove(const protocol::StudyStatus& study) {
  protocol::ClientRequest request;
  request.mutable_change()->set_study(study.name());
  request.mutable_change()->set_study_id(study.study_id());
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_DELETE);
  return call(std::move(request)).change();
}

protocol::Recipe Connection::describe(const std::string& study) {
  protocol::ClientRequest request;
  request.mutable_describe()->set_study(study);
  return call(std::move(request)).describe().recipe();
}

}  // namespace oblique::client
