#include "tests/bench/load/status_probe.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "proto/socket/socket.h"

namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

double StatusProbe::Seen::quantile_ms(double share) const {
  if (latencies_ms.empty()) {
    return 0.0;
  }
  const double rank = std::ceil(share * static_cast<double>(latencies_ms.size()));
  return latencies_ms[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

StatusProbe::StatusProbe(std::string client_url, std::optional<protocol::KeyFile> key,
                         std::string study, std::chrono::milliseconds interval)
    : client_url_(std::move(client_url)),
      key_(std::move(key)),
      study_(std::move(study)),
      interval_(interval),
      thread_([this] { run(); }) {}

StatusProbe::~StatusProbe() {
  stopping_ = true;
  if (thread_.joinable()) {
    thread_.join();
  }
}

StatusProbe::Seen StatusProbe::stop() {
  stopping_ = true;
  thread_.join();
  std::sort(seen_.latencies_ms.begin(), seen_.latencies_ms.end());
  return std::move(seen_);
}

void StatusProbe::run() {
  zmq::context_t context;
  const protocol::DealerSettings settings{
      .url = client_url_, .example_url = client_url_, .key = key_};
  zmq::socket_t socket = protocol::make_dealer(context, settings);
  protocol::connect(socket, settings);
  protocol::ClientRequest request;
  request.set_protocol_version(protocol::kProtocolVersion);
  request.mutable_status()->set_study(study_);
  std::map<std::uint64_t, Clock::time_point> open_requests;  // send time of each open request
  Clock::time_point next = Clock::now();
  while (!stopping_ || (!open_requests.empty() && Clock::now() < next + std::chrono::seconds(1))) {
    if (!stopping_ && Clock::now() >= next) {
      request.set_request_id(request.request_id() + 1);
      open_requests[request.request_id()] = Clock::now();
      socket.send(zmq::buffer(protocol::encode(request)), zmq::send_flags::none);
      next += interval_;
    }
    zmq::pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
    constexpr std::chrono::milliseconds kLongestWait{20};
    const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(next - Clock::now());
    zmq::poll(&item, 1, std::clamp(wait, std::chrono::milliseconds(0), kLongestWait));
    zmq::message_t frame;
    while (socket.recv(frame, zmq::recv_flags::dontwait)) {
      protocol::ClientReply reply;
      const bool is_reply = protocol::decode({frame.data<char>(), frame.size()}, reply);
      const auto found = open_requests.find(reply.request_id());
      if (!is_reply || found == open_requests.end()) {
        continue;
      }
      const std::chrono::duration<double, std::milli> latency = Clock::now() - found->second;
      seen_.latencies_ms.push_back(latency.count());
      open_requests.erase(found);
      if (reply.has_status() && reply.status().studies_size() == 1) {
        const auto& study = reply.status().studies(0);
        seen_.settled = study.solved() + study.failed();
        seen_.leased = study.leased();
        seen_.workers = reply.status().workers();
      }
    }
  }
  seen_.unanswered = open_requests.size();
}

}  // namespace oblique::bench
