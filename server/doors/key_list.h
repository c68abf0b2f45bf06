#pragma once

#include <sys/stat.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "proto/keys/key_file.h"
#include "server/network/curve/doorkeeper.h"

namespace oblique::server {

/// The list of authorized keys as a running server knows it. It follows the file; one that cannot
/// be read, or is gone, as in the middle of an edit, leaves the last good list as it was.
class KeyList {
 public:
  /// Throws solver::InputError when the list cannot be read.
  explicit KeyList(std::string path);
  using Clock = std::chrono::system_clock;

  /// What a look at the file has brought.
  struct News {
    bool admission_changed;
    bool is_fault;
    std::string text;  ///< for the log
  };
  /// Looks whether the file is another one than before. Each fault is told once.
  std::optional<News> look(Clock::time_point now = Clock::now());

  std::size_t size() const { return holders_.size(); }
  const std::string& path() const { return path_; }
  /// Whose key it is. Null: nobody's.
  std::shared_ptr<const KeyHolder> find(const protocol::CurveKey& key) const;
  /// Whether it was on the list since the server began.
  bool was_listed(const protocol::CurveKey& key) const { return revoked_.contains(key); }

 private:
  using Stamp = std::tuple<dev_t, ino_t, off_t, std::int64_t, std::int64_t>;
  using Holders = std::map<protocol::CurveKey, std::shared_ptr<const KeyHolder>>;

  std::optional<Stamp> stamp() const;
  bool is_fresh(Clock::time_point now) const;
  Holders read() const;
  std::string take(Holders holders);

  std::string path_;
  std::optional<Stamp> seen_;
  bool was_fresh_;
  std::string fault_;
  Holders holders_;
  std::set<protocol::CurveKey> revoked_;
};

/// Admits those keys of the list that are for its port.
class PortKeeper final : public Doorkeeper {
 public:
  enum class Port { kClients, kWorkers };
  PortKeeper(std::shared_ptr<const KeyList> list, Port port)
      : list_(std::move(list)), port_(port) {}
  Verdict judge(const protocol::CurveKey& public_key) const override;

 private:
  std::shared_ptr<const KeyList> list_;
  Port port_;
};

}  // namespace oblique::server
