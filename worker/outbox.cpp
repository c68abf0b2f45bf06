#include "worker/outbox.h"

#include <algorithm>
#include <utility>

namespace oblique::worker {

void Outbox::add(protocol::Results results) {
  results.set_sequence(next_sequence_++);
  const std::size_t bytes = results.ByteSizeLong();
  results_ += static_cast<std::size_t>(results.results_size());
  bytes_ += bytes;
  unacknowledged_.push_back({std::move(results), bytes, false});
}

const protocol::Results* Outbox::next_to_send() {
  if (!has_waiting()) {
    return nullptr;
  }
  Message& next = unacknowledged_[on_their_way_];
  if (on_their_way_ > 0 && (on_their_way_ >= limits_.messages_on_their_way ||
                            bytes_on_their_way_ + next.bytes > limits_.bytes_on_their_way)) {
    return nullptr;
  }
  next.on_its_way = true;
  ++on_their_way_;
  bytes_on_their_way_ += next.bytes;
  return &next.results;
}

void Outbox::acknowledged(std::uint64_t sequence) {
  const auto found = std::lower_bound(unacknowledged_.begin(), unacknowledged_.end(), sequence,
                                      [](const Message& message, std::uint64_t sought) {
                                        return message.results.sequence() < sought;
                                      });
  if (found != unacknowledged_.end() && found->results.sequence() == sequence) {
    forget(*found);
    unacknowledged_.erase(found);
  }
}

void Outbox::drop_study(std::uint64_t study_id) {
  std::erase_if(unacknowledged_, [&](const Message& message) {
    const bool is_of_study = message.results.study_id() == study_id;
    if (is_of_study) {
      forget(message);
    }
    return is_of_study;
  });
}

void Outbox::drop_all() {
  unacknowledged_.clear();
  results_ = 0;
  bytes_ = 0;
  on_their_way_ = 0;
  bytes_on_their_way_ = 0;
}

void Outbox::start_over() {
  for (Message& message : unacknowledged_) {
    message.results.set_lease_id(0);
    message.results.set_batch_done(false);
    message.on_its_way = false;
  }
  on_their_way_ = 0;
  bytes_on_their_way_ = 0;
}

void Outbox::forget(const Message& message) {
  results_ -= static_cast<std::size_t>(message.results.results_size());
  bytes_ -= message.bytes;
  if (message.on_its_way) {
    --on_their_way_;
    bytes_on_their_way_ -= message.bytes;
  }
}

}  // namespace oblique::worker
