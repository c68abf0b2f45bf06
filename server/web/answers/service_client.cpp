#include "server/web/answers/service_client.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "proto/frames.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

RecipeCache::Table RecipeCache::find(std::uint64_t study, std::uint64_t points) const {
  const auto found =
      std::ranges::find(kept_, study, &std::pair<std::uint64_t, RecipeCache::Table>::first);
  return found != kept_.end() && found->second->size() == points ? found->second : nullptr;
}

void RecipeCache::put(std::uint64_t study, Table table) {
  std::erase_if(kept_, [study](const auto& kept) { return kept.first == study; });
  kept_.emplace_front(study, std::move(table));
  if (kept_.size() > limits::kRecipesOfPage) {
    kept_.pop_back();
  }
}

void ServiceClient::ask(std::uint64_t number, protocol::ClientRequest request) {
  request.set_request_id(number);
  Awaited& awaited = awaited_[number];
  awaited.may_end = awaited.may_end || request.has_query() || request.has_trace();
  send(std::move(request));
}

std::optional<protocol::ClientReply> ServiceClient::reply(std::uint64_t number) {
  decode_frames();
  const auto found = awaited_.find(number);
  if (found == awaited_.end() || found->second.replies.empty()) {
    return std::nullopt;
  }
  auto reply = std::move(found->second.replies.front());
  found->second.replies.pop_front();
  return reply;
}

void ServiceClient::decode_frames() {
  std::vector<std::string> frames;
  {
    const std::lock_guard lock(mutex_);
    frames.swap(frames_);
  }
  for (const std::string& frame : frames) {
    protocol::ClientReply reply;
    if (!protocol::decode(frame, reply)) {
      continue;
    }
    const auto awaited = awaited_.find(reply.request_id());
    if (awaited == awaited_.end() || reply.has_still_working()) {
      continue;  // not needed; the first is a reply to a dropped request
    }
    const bool is_part = reply.has_query() && !reply.query().ends();
    awaited->second.may_end = awaited->second.may_end && is_part;
    awaited->second.replies.push_back(std::move(reply));
  }
}

void ServiceClient::forget(std::uint64_t number) {
  const auto awaited = awaited_.extract(number);
  if (!awaited.empty() && awaited.mapped().may_end) {
    protocol::ClientRequest request;
    request.mutable_end_query()->set_request_id(number);
    send(std::move(request));
  }
}

void ServiceClient::send(protocol::ClientRequest request) {
  request.set_protocol_version(protocol::kProtocolVersion);
  const std::lock_guard lock(mutex_);
  requests_.push_back(protocol::encode(request));
  woken_.wake();
}

std::vector<std::string> ServiceClient::take() {
  constexpr std::size_t kMaxATurn = 8;  // few requests, so that the loop is not blocked for long
  woken_.clear();
  const std::lock_guard lock(mutex_);
  std::vector<std::string> some;
  while (!requests_.empty() && some.size() < kMaxATurn) {
    some.push_back(std::move(requests_.front()));
    requests_.pop_front();
  }
  if (!requests_.empty()) {
    woken_.wake();
  }
  return some;
}

void ServiceClient::put(std::string frame) {
  const std::lock_guard lock(mutex_);
  frames_.push_back(std::move(frame));
}

HttpAnswer failure(const protocol::ErrorReply& error) {
  if (error.code() == protocol::ERROR_CODE_NO_SUCH_STUDY) {
    return error_answer(MHD_HTTP_NOT_FOUND, "there is no such study");
  }
  return error_answer(
      error.code() == protocol::ERROR_CODE_WRONG_REQUEST ? MHD_HTTP_BAD_REQUEST : MHD_HTTP_CONFLICT,
      error.message());
}

}  // namespace oblique::server
