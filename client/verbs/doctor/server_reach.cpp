#include "client/verbs/doctor/server_reach.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/service/connection.h"
#include "proto/address.h"
#include "proto/keys/key_file.h"
#include "proto/program/origin/origin.h"
#include "proto/system/descriptor.h"

namespace oblique::client::doctor {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};

std::string written(const addrinfo& address) {
  std::array<char, NI_MAXHOST> host{};
  const int failed = getnameinfo(address.ai_addr, address.ai_addrlen, host.data(), host.size(),
                                 nullptr, 0, NI_NUMERICHOST);
  return failed != 0 ? std::string("?") : std::string(host.data());
}

/// 0, or the error with which no connection was made until `end`.
int error_of_connecting(const addrinfo& address, Clock::time_point end) {
  const protocol::Descriptor socket(
      ::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.number() < 0) {
    return errno;
  }
  if (::connect(socket.number(), address.ai_addr, address.ai_addrlen) == 0) {
    return 0;
  }
  if (errno != EINPROGRESS) {
    return errno;
  }
  pollfd ready{socket.number(), POLLOUT, 0};
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
  if (::poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(0, left.count()))) != 1) {
    return ETIMEDOUT;
  }
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(socket.number(), SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

/// Looks the name up and connects to one of its addresses; false where it goes no further.
bool reaches(Findings& found, const std::string& host, const std::string& port,
             Clock::time_point end) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const auto asked = Clock::now();
  const int failed = getaddrinfo(host.c_str(), port.c_str(), &hints, &list);
  const std::unique_ptr<addrinfo, FreeAddresses> addresses(list);
  if (failed != 0) {
    found.add("addresses", "addresses", gai_strerror(failed), nullptr);
    found.broken.push_back(fmt::format(
        "No address is known here for the server's name {} ({}): check it, the name service or "
        "/etc/hosts.",
        host, gai_strerror(failed)));
    return false;
  }
  auto names = nlohmann::ordered_json::array();
  std::string listed;
  for (const addrinfo* each = list; each != nullptr; each = each->ai_next) {
    names.push_back(written(*each));
    listed += (listed.empty() ? "" : ", ") + written(*each);
  }
  found.add("addresses", "addresses",
            fmt::format("{} (found in {})", listed, shown_milliseconds(seconds_since(asked))),
            names);
  std::string errors;
  for (const addrinfo* each = list; each != nullptr; each = each->ai_next) {
    const auto began = Clock::now();
    // Others may be tried, and then it is to be asked.
    constexpr std::chrono::milliseconds kUsual{500};
    const auto longest = std::max<Clock::duration>(kUsual, (end - began) / 3);
    const int error = error_of_connecting(*each, std::min(end, began + longest));
    if (error == 0) {
      const double lasted_s = seconds_since(began);
      found.add("connects_s", "connects",
                fmt::format("to {} in {}", written(*each), shown_milliseconds(lasted_s)), lasted_s);
      return true;
    }
    errors += fmt::format("{}{}: {}", errors.empty() ? "" : "; ", written(*each),
                          std::strerror(error));  // NOLINT(concurrency-mt-unsafe)
  }
  found.add("connects_s", "connects", fmt::format("no: {}", errors), nullptr);
  found.broken.push_back(fmt::format(
      "Nothing takes connections at port {} of {} ({}): start oblique-server there, with --listen "
      "for other machines, and let the port through its firewall.",
      port, host, errors));
  return false;
}

/// A refusal names the key that was shown, which those who read the report need not have.
std::string without_key(std::string text, const std::optional<protocol::KeyFile>& key) {
  const std::string shown = key ? ", public key " + protocol::z85(key->pair.public_key) : "";
  if (const auto at = shown.empty() ? std::string::npos : text.find(shown);
      at != std::string::npos) {
    text.erase(at, shown.size());
  }
  return text;
}

void judge(Findings& found, const protocol::StatusReply& status, double round_trip_s,
           std::chrono::system_clock::time_point half_way) {
  found.add("version", status.version());
  found.add("round_trip_s", "round trip", shown_milliseconds(round_trip_s), round_trip_s);
  found.add("access", status.access());
  found.add("workers", "workers", shown_count(status.workers()), status.workers());
  if (status.version() != protocol::version_and_commit()) {
    found.odd.push_back(
        fmt::format("The server is oblique-server {}, this client {}: one of them may know what "
                    "the other does not. Install the same on both when it suits.",
                    status.version(), protocol::version_and_commit()));
  }
  constexpr double kSame_s = 0.01;
  const double own_s = std::chrono::duration<double>(half_way.time_since_epoch()).count();
  const double ahead_s = 1e-3 * static_cast<double>(status.utc_ms()) - own_s;
  found.add("clock_ahead_s", "its clock",
            std::fabs(ahead_s) < kSame_s ? std::string("the same as ours")
                                         : fmt::format("{:.2f} s {} ours", std::fabs(ahead_s),
                                                       ahead_s < 0 ? "behind" : "ahead of"),
            ahead_s);
  constexpr double kMostAhead_s = 2.0;
  if (std::fabs(ahead_s) > kMostAhead_s) {
    found.odd.push_back(fmt::format(
        "The clocks of server and client are {:.1f} s apart: results are dated by the server's. "
        "Have both kept right (NTP).",
        std::fabs(ahead_s)));
  }
  constexpr double kLong_s = 0.3;
  if (round_trip_s > kLong_s) {
    found.odd.push_back(
        fmt::format("The server answers after {}: the line is long, or the server has much to do.",
                    shown_milliseconds(round_trip_s)));
  }
  if (status.workers() == 0) {
    found.odd.push_back("No worker is there: studies wait until an oblique-worker joins.");
  }
  if (status.access() == "insecure") {
    found.odd.push_back(
        "The server lets in whoever reaches it, unencrypted (--insecure): make "
        "keys with `oblique keygen`.");
  }
  if (status.draining()) {
    found.odd.push_back("The server is about to end (it drains): studies go on when it is back.");
  }
}

}  // namespace

Findings examine_server(const ServerMeant& server, Clock::time_point end) {
  Findings found{"server", "server"};
  found.add("address", server.url);
  if (const auto objection = protocol::objection_to_address(server.url); !objection.empty()) {
    found.broken.push_back(as_sentence(objection));
    return found;
  }
  ConnectionSettings settings;
  settings.server_url = server.url;
  if (!server.key_file.empty()) {
    try {
      settings.key = protocol::read_key_file(server.key_file);
      found.add("key", "key",
                fmt::format("{} ({}), {}", settings.key->name,
                            protocol::name_of(settings.key->role), server.key_file),
                {{"name", settings.key->name},
                 {"role", protocol::name_of(settings.key->role)},
                 {"file", server.key_file}});
    } catch (const std::exception&) {
      found.add("key", "key", "cannot be used, so the server was not asked; see below", nullptr);
      return found;  // the settings say why
    }
  } else {
    found.add("key", "key", "none", nullptr);
  }
  const std::string host = protocol::host_of(server.url);
  const std::string port = server.url.substr(server.url.rfind(':') + 1);
  if (!host.empty() && !reaches(found, host, port, end)) {
    return found;
  }
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
  settings.timeout_ms = std::max<std::int64_t>(1, left.count());
  settings.resend_after_ms = settings.timeout_ms;
  try {
    Connection connection(settings);
    (void)connection.greeting();  // with the connection and its keys
    const auto asked = Clock::now();
    const auto asked_at = std::chrono::system_clock::now();
    const auto status = connection.greeting();
    const auto lasted = Clock::now() - asked;
    judge(found, status, std::chrono::duration<double>(lasted).count(), asked_at + lasted / 2);
  } catch (const std::exception& error) {
    found.broken.push_back(as_sentence(without_key(error.what(), settings.key)));
  }
  return found;
}

}  // namespace oblique::client::doctor
