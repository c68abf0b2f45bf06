#include "server/web/page/service_line.h"

#include <cstddef>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

/// So that the loop looks at others in between.
constexpr std::size_t kMostOfATurn = 8;
/// Of older ones the time is over at the service.
constexpr std::size_t kMostLeftTraces = 256;

}  // namespace

void ServiceLine::ask(std::uint64_t number, protocol::ClientRequest request, bool is_strangers) {
  request.set_request_id(number);
  Awaited& awaited = awaited_.try_emplace(number, Awaited{is_strangers}).first->second;
  awaited.is_query = awaited.is_query || request.has_query();
  awaited.trace = request.has_trace() ? request.trace().SerializeAsString() : std::string();
  send(request, awaited.is_strangers);
  if (request.has_trace()) {
    end_those_before(awaited.trace);  // after the new one waits, or the work would be lost
  }
}

bool ServiceLine::is_strangers(std::uint64_t number) const {
  const auto awaited = awaited_.find(number);
  return awaited != awaited_.end() && awaited->second.is_strangers;
}

std::optional<protocol::ClientReply> ServiceLine::reply(std::uint64_t number) {
  std::vector<std::string> frames;
  {
    const std::lock_guard lock(mutex_);
    frames = std::exchange(frames_, {});
  }
  for (const std::string& frame : frames) {
    protocol::ClientReply reply;
    // What tells that something takes long has the number of no request.
    const bool is_reply = protocol::decode(frame, reply);
    const auto awaited = awaited_.find(reply.request_id());
    if (is_reply && awaited != awaited_.end()) {
      const bool is_part = reply.has_query() && !reply.query().ends();
      awaited->second.is_query = awaited->second.is_query && is_part;
      awaited->second.trace.clear();
      awaited->second.replies.push_back(std::move(reply));
    }
  }
  const auto found = awaited_.find(number);
  if (found == awaited_.end() || found->second.replies.empty()) {
    return std::nullopt;
  }
  auto reply = std::move(found->second.replies.front());
  found->second.replies.pop_front();
  return reply;
}

void ServiceLine::forget(std::uint64_t number) {
  const auto awaited = awaited_.extract(number);
  if (!awaited.empty() && (awaited.mapped().is_query || !awaited.mapped().trace.empty())) {
    end(number, awaited.mapped().is_strangers);
  }
}

void ServiceLine::leave(std::uint64_t number) {
  const auto awaited = awaited_.find(number);
  if (awaited == awaited_.end() || awaited->second.trace.empty()) {
    forget(number);
    return;
  }
  left_traces_.push_back({std::move(awaited->second.trace), number, awaited->second.is_strangers});
  awaited_.erase(awaited);
  if (left_traces_.size() > kMostLeftTraces) {
    left_traces_.pop_front();
  }
}

void ServiceLine::end_those_before(const std::string& trace) {
  std::erase_if(left_traces_, [&](const auto& left) {
    if (left.request == trace) {
      end(left.number, left.is_strangers);
    }
    return left.request == trace;
  });
}

void ServiceLine::end(std::uint64_t number, bool is_strangers) {
  protocol::ClientRequest request;
  request.mutable_end_query()->set_request_id(number);
  send(request, is_strangers);
}

void ServiceLine::send(const protocol::ClientRequest& request, bool is_strangers) {
  protocol::ClientRequest versioned = request;
  versioned.set_protocol_version(protocol::kProtocolVersion);
  std::string frame = protocol::encode(versioned);
  {
    const std::lock_guard lock(mutex_);
    requests_.push_back({is_strangers ? kStrangers : kIdentity, std::move(frame)});
  }
  woken_.wake();
}

std::vector<ServiceLine::Request> ServiceLine::take() {
  woken_.clear();
  const std::lock_guard lock(mutex_);
  std::vector<Request> some;
  while (!requests_.empty() && some.size() < kMostOfATurn) {
    some.push_back(std::move(requests_.front()));
    requests_.pop_front();
  }
  if (!requests_.empty()) {
    woken_.wake();
  }
  return some;
}

void ServiceLine::put(std::string frame) {
  const std::lock_guard lock(mutex_);
  frames_.push_back(std::move(frame));
}

}  // namespace oblique::server
