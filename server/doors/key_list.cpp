#include "server/doors/key_list.h"

#include <cstdint>
#include <ctime>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

std::int64_t nanoseconds_of(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void append(std::string& names, const std::string& name) {
  names += (names.empty() ? "" : ", ") + name;
}

}  // namespace

KeyList::KeyList(std::string path)
    : path_(std::move(path)),
      seen_(stamp()),
      was_fresh_(is_fresh(Clock::now())),
      holders_(read()) {}

std::optional<KeyList::Stamp> KeyList::stamp() const {
  struct stat file {};
  if (::stat(path_.c_str(), &file) != 0) {
    return std::nullopt;
  }
  return Stamp{file.st_dev, file.st_ino, file.st_size, nanoseconds_of(file.st_mtim),
               nanoseconds_of(file.st_ctim)};
}

/// Of the file as it was seen. Systems count time in steps, some of a second: a change so soon
/// after another one may leave the same stamp.
bool KeyList::is_fresh(Clock::time_point now) const {
  constexpr std::chrono::seconds kStep{2};
  if (!seen_) {
    return false;
  }
  const auto age = now.time_since_epoch() - std::chrono::nanoseconds(std::get<4>(*seen_));
  return age > -kStep && age < kStep;
}

KeyList::Holders KeyList::read() const {
  Holders holders;
  const protocol::AuthorizedKeys listed = protocol::read_authorized_keys(path_);
  for (const auto& key : listed.all()) {
    holders.emplace(key.public_key,
                    std::make_shared<const KeyHolder>(KeyHolder{key.name, key.role}));
  }
  return holders;
}

std::optional<KeyList::News> KeyList::look(Clock::time_point now) {
  const auto found = stamp();
  if (found == seen_ && !was_fresh_) {
    return std::nullopt;
  }
  seen_ = found;
  was_fresh_ = is_fresh(now);
  try {
    Holders holders = read();
    if (holders.empty() && !holders_.empty() && was_fresh_) {
      return std::nullopt;  // perhaps being written in place: what is there in 2 s counts
    }
    const bool was_at_fault = !std::exchange(fault_, {}).empty();
    std::string changes = take(std::move(holders));
    if (changes.empty() && !was_at_fault) {
      return std::nullopt;
    }
    return News{!changes.empty(), false,
                fmt::format("{} has {} keys{}", path_, holders_.size(), changes)};
  } catch (const solver::InputError& error) {
    if (std::exchange(fault_, error.what()) == error.what()) {
      return std::nullopt;
    }
    return News{false, true,
                fmt::format("the keys that were listed before are admitted still: {}", fault_)};
  }
}

/// What has changed, as a sentence part; empty: nothing.
std::string KeyList::take(Holders holders) {
  std::string added;
  std::string revoked;
  for (const auto& [key, holder] : holders) {
    const auto before = holders_.find(key);
    if (before == holders_.end() || *before->second != *holder) {
      append(added, fmt::format("{} ({})", holder->name, name_of(holder->role)));
    }
    revoked_.erase(key);
  }
  for (const auto& [key, holder] : holders_) {
    if (!holders.contains(key)) {
      append(revoked, holder->name);
      revoked_.insert(key);
    }
  }
  holders_ = std::move(holders);
  return (added.empty() ? "" : "; new: " + added) +
         (revoked.empty() ? "" : "; revoked: " + revoked);
}

std::shared_ptr<const KeyHolder> KeyList::find(const protocol::CurveKey& key) const {
  const auto found = holders_.find(key);
  return found == holders_.end() ? nullptr : found->second;
}

Verdict PortKeeper::judge(const protocol::CurveKey& public_key) const {
  auto holder = list_->find(public_key);
  if (holder == nullptr) {
    const bool was_listed = list_->was_listed(public_key);
    return Refusal{was_listed ? RefusalCause::kRevokedKey : RefusalCause::kUnknownKey,
                   fmt::format("its key {} {}", protocol::z85(public_key),
                               was_listed ? "was revoked" : "is not listed")};
  }
  const bool is_workers = holder->role == protocol::Role::kWorker;
  if (is_workers != (port_ == Port::kWorkers)) {
    return Refusal{RefusalCause::kOtherRole,
                   fmt::format("its key \"{}\" is a {}'s, and this port is for {}", holder->name,
                               name_of(holder->role), is_workers ? "clients" : "workers")};
  }
  return holder;
}

}  // namespace oblique::server
