#include "server/network/access.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <netinet/in.h>
#include <sys/socket.h>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "proto/keys/key_file.h"
#include "proto/small_file.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "server/network/listener.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

std::string numeric(const std::string& address) {
  if (address == "localhost") {
    return "127.0.0.1";
  }
  if (address == "*") {
    const protocol::Descriptor v6(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, IPPROTO_TCP));
    return v6.is_open() ? "::" : "0.0.0.0";
  }
  return address;
}

AccessMode mode_of(const AccessSettings& settings) {
  if (!settings.keys.empty()) {
    return AccessMode::kKeys;
  }
  return settings.insecure ? AccessMode::kInsecure : AccessMode::kLoopback;
}

protocol::KeyPair read_server_key(const std::string& path) {
  protocol::KeyFile key = protocol::read_key_file(path);
  if (key.role != protocol::Role::kServer) {
    throw solver::InputError(fmt::format(
        "{} is the key of a {}: give a server key, as DIR/server.key of `oblique keygen DIR`, "
        "with --keys or OBLIQUE_SERVER_KEYS, which override OBLIQUE_KEYS",
        path, name_of(key.role)));
  }
  return std::move(key.pair);
}

using Keys = std::map<protocol::CurveKey, std::shared_ptr<const KeyIdentity>>;

/// Returns `title` and the names of the `keys` that `others` lacks or has with another identity;
/// empty if there are none.
std::string names_of_others(const char* title, const Keys& keys, const Keys& others) {
  std::string names;
  for (const auto& [key, identity] : keys) {
    const auto other = others.find(key);
    if (other == others.end() || *other->second != *identity) {
      names += fmt::format("{}{} ({})", names.empty() ? title : ", ", identity->name,
                           name_of(identity->role));
    }
  }
  return names;
}

}  // namespace

std::string_view name_of(AccessMode mode) {
  constexpr std::array<std::string_view, 3> kNames{"loopback", "keys", "insecure"};
  return kNames.at(static_cast<std::size_t>(mode));
}

std::string address_to_bind(const AccessSettings& settings) {
  if (!settings.keys.empty() && settings.insecure) {
    throw solver::InputError(
        "--keys and --insecure cannot be combined: with --keys every peer needs a key, with "
        "--insecure none does");
  }
  std::string address = numeric(settings.listen);
  const std::optional<bool> is_local = is_loopback(address);
  if (!is_local) {
    throw solver::InputError(
        fmt::format("--listen {} is not an address: give a numeric address of this machine, as "
                    "127.0.0.1 or ::1, "
                    "or * for all",
                    protocol::visible(settings.listen)));
  }
  if (!*is_local && mode_of(settings) == AccessMode::kLoopback) {
    throw solver::InputError(fmt::format(
        "--listen {} is refused: other machines can reach that address, and there are no keys. "
        "Create keys with `oblique keygen DIR` and give --keys DIR/server.key, or give --insecure "
        "to "
        "admit every peer. Otherwise only loopback is allowed, as 127.0.0.1 or ::1",
        settings.listen));
  }
  return address;
}

class KeyList {
 public:
  explicit KeyList(std::string path) : path_(std::move(path)), keys_(read()) {}

  bool reload();
  std::shared_ptr<const KeyIdentity> find(const protocol::CurveKey& key) const {
    const auto found = keys_.find(key);
    return found == keys_.end() ? nullptr : found->second;
  }
  std::string text() const { return fmt::format("admits the {} keys of {}", keys_.size(), path_); }

 private:
  Keys read() const {
    Keys keys;
    const protocol::AuthorizedKeys listed = protocol::read_authorized_keys(path_);
    for (const auto& key : listed.all()) {
      keys.emplace(key.public_key,
                   std::make_shared<const KeyIdentity>(KeyIdentity{key.name, key.role}));
    }
    return keys;
  }

  std::string path_;
  Keys keys_;
  std::optional<std::string> file_;  // content at the last read
  int empty_reads_ = 0;              // number of empty reads in a row
  std::string fault_;                // reason why the last read failed; empty if it succeeded
};

bool KeyList::reload() {
  constexpr int kEmptyReads = 4;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
  try {
    // Parses the file only if it has changed, because parsing thousands of keys takes long.
    std::optional file = protocol::read_small_file(path_, "the list of keys", kMaxBytes);
    if (file == file_ && empty_reads_ == 0 && fault_.empty()) {
      return false;
    }
    file_ = std::move(file);
    Keys keys = read();
    empty_reads_ = keys.empty() ? empty_reads_ + 1 : 0;
    if (keys.empty() && empty_reads_ < kEmptyReads) {
      return false;  // an editor may empty the file before it writes the new text
    }
    const bool had_fault = !std::exchange(fault_, {}).empty();
    keys.swap(keys_);
    const std::string changes =
        names_of_others("; new: ", keys_, keys) + names_of_others("; revoked: ", keys, keys_);
    if (had_fault || !changes.empty()) {
      spdlog::info("{}{}", text(), changes);
    }
    return !changes.empty();
  } catch (const solver::InputError& error) {
    if (std::exchange(fault_, error.what()) != error.what()) {
      spdlog::warn("the admitted keys stay the same, because the list cannot be used: {}", fault_);
    }
    return false;
  }
}

AccessControl::AccessControl(const AccessSettings& settings)
    : address_(address_to_bind(settings)), mode_(mode_of(settings)) {
  if (mode_ == AccessMode::kKeys) {
    server_ = read_server_key(settings.keys);
    list_ = std::make_shared<KeyList>(
        protocol::authorized_keys_in(std::filesystem::path(settings.keys).parent_path()));
    spdlog::info("{}; its own public key is {}", list_->text(), protocol::z85(server_.public_key));
  }
}

std::optional<PortSecurity> AccessControl::security(PortRole port) const {
  if (!list_) {
    return std::nullopt;
  }
  return PortSecurity{
      server_, [list = list_, port](const auto& public_key) -> AuthResult {
        auto identity = list->find(public_key);
        if (!identity) {
          return Refusal{RefusalCause::kUnknownKey,
                         fmt::format("its key {} is not listed", protocol::z85(public_key))};
        }
        const bool is_worker = identity->role == protocol::Role::kWorker;
        if (is_worker != (port == PortRole::kWorkers)) {
          return Refusal{
              RefusalCause::kOtherRole,
              fmt::format("its key \"{}\" has the role {}, but this port is for {}", identity->name,
                          name_of(identity->role), is_worker ? "clients" : "workers")};
        }
        return identity;
      }};
}

bool AccessControl::refresh(std::int64_t now_ms) {
  constexpr std::int64_t kRefreshInterval_ms = 500;
  constexpr std::int64_t kWarningInterval_ms = 600'000;
  if (mode_ == AccessMode::kInsecure && now_ms >= next_warning_ms_) {
    next_warning_ms_ = now_ms + kWarningInterval_ms;
    spdlog::warn(
        "INSECURE: every machine that reaches {} can submit, cancel and read studies and store "
        "false results, and all traffic is plain text, because the server was started with "
        "--insecure. `oblique keygen` creates keys",
        address_);
  }
  if (!list_ || now_ms < next_refresh_ms_) {
    return false;
  }
  next_refresh_ms_ = now_ms + kRefreshInterval_ms;
  return list_->reload();
}

}  // namespace oblique::server
