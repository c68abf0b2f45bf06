#include "tests/system/networks/lan.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::test {
namespace {

[[noreturn]] void refused(const std::string& what) {
  throw NoNamespaces(
      fmt::format("this machine does not let us make networks: {}: {}", what, strerror(errno)));
}

void write_to(const std::string& file, const std::string& text) {
  std::ofstream(file) << text;
}

/// Enters new namespaces. Requires root only if the system allows no user namespaces.
void enter_namespaces() {
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWNS) == 0) {
    write_to("/proc/self/setgroups", "deny");
    write_to("/proc/self/uid_map", fmt::format("0 {} 1", user));
    write_to("/proc/self/gid_map", fmt::format("0 {} 1", group));
  } else if (unshare(CLONE_NEWNET | CLONE_NEWNS) != 0) {
    refused("unshare");
  }
  if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) {
    refused("mount");
  }
}

protocol::Descriptor present_network() {
  protocol::Descriptor network(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
  if (!network.is_open()) {
    refused("/proc/thread-self/ns/net");
  }
  return network;
}

void enter(const protocol::Descriptor& network) {
  if (setns(network.number(), CLONE_NEWNET) != 0) {
    refused("setns");
  }
}

protocol::Descriptor new_network() {
  const protocol::Descriptor before = present_network();
  if (unshare(CLONE_NEWNET) != 0) {
    refused("unshare");
  }
  protocol::Descriptor made = present_network();
  enter(before);
  return made;
}

/// Runs `command` in the namespaces of this thread and returns its output.
std::string run_here(const TemporaryFolder& folder, const std::string& command) {
  // The PATH of users other than root may lack sbin.
  const Outcome ran =
      Process(folder, "/bin/sh", {"-ec", command}, {{"PATH", "/usr/sbin:/usr/bin:/sbin:/bin"}})
          .outcome();
  if (ran.exit_code != 0) {
    throw std::runtime_error(command + ": " + ran.err);
  }
  return ran.out;
}

}  // namespace

// ---- Namespaces of this thread ------------------------------------------------------------------

Inside::Inside(const Host& host) : before_(present_network()) {
  if (setns(host.network(), CLONE_NEWNET) != 0) {
    refused("setns");
  }
}

Inside::~Inside() {
  static_cast<void>(setns(before_.number(), CLONE_NEWNET));
}

// ---- A machine ----------------------------------------------------------------------------------

Host::Host(const TemporaryFolder& folder, std::string name, int last)
    : folder_(&folder), name_(std::move(name)), last_(last), network_(new_network()) {}

std::string Host::v4() const {
  return fmt::format("10.77.0.{}", last_);
}
std::string Host::v6() const {
  return fmt::format("fd77::{}", last_);
}
std::string Host::link_local() const {
  return fmt::format("fe80::4d:{}", last_);
}

std::string Host::run(const std::string& command) const {
  const Inside inside(*this);
  return run_here(*folder_, command);
}

void Host::pull_cable() const {
  run_here(*folder_, "ip link set dev to-" + name_ + " down");
}

void Host::plug_cable() const {
  run_here(*folder_, "ip link set dev to-" + name_ + " up");
}

void Host::lose_percent(int percent) const {
  run(
      fmt::format("nft 'table inet loss {{ chain in {{ type filter hook input priority 0;"
                  " iifname eth0 numgen random mod 100 < {} drop; }}; }}'",
                  percent));
}

void Host::lose_everything() const {
  run("nft 'table inet loss { chain in { type filter hook input priority 0; iifname eth0 drop; };"
      " chain out { type filter hook output priority 0; oifname eth0 drop; }; }'");
}

void Host::lose_nothing() const {
  run("nft 'table inet loss { }; delete table inet loss'");
}

void Host::renumber(int last) {
  const std::string before =
      fmt::format("ip address del {}/24 dev eth0; ip address del {}/64 dev eth0;", v4(), v6());
  last_ = last;
  run(before + fmt::format("ip address add {}/24 dev eth0; ip address add {}/64 dev eth0 nodad",
                           v4(), v6()));
}

// ---- The network --------------------------------------------------------------------------------

Lan::Lan(const TemporaryFolder& folder) : folder_(&folder) {
  enter_namespaces();
  run_here(folder,
           "ip link set dev lo up;"
           "ip link add name switch type bridge forward_delay 0 mcast_snooping 0;"
           "ip link set dev switch up");
  const std::string hosts = folder.file("hosts");
  write_to(hosts, "");
  if (mount(hosts.c_str(), "/etc/hosts", nullptr, MS_BIND, nullptr) != 0) {
    refused("/etc/hosts");
  }
}

Lan::~Lan() {
  static_cast<void>(umount2("/etc/hosts", MNT_DETACH));
}

Host& Lan::add(const std::string& name, int last) {
  Host& host = *hosts_.emplace_back(std::unique_ptr<Host>(new Host(*folder_, name, last)));
  // The `ip` command opens the namespace by the path of a descriptor of this process.
  run_here(*folder_, fmt::format("ip link add name to-{0} type veth peer name cable;"
                                 "ip link set dev cable netns /proc/{1}/fd/{2};"
                                 "ip link set dev to-{0} master switch up",
                                 name, getpid(), host.network()));
  host.run(
      fmt::format("ip link set dev lo up; ip link set dev cable name eth0 addrgenmode none;"
                  "ip address add {}/24 dev eth0; ip address add {}/64 dev eth0 nodad;"
                  "ip address add {}/64 dev eth0 nodad; ip link set dev eth0 up",
                  host.v4(), host.v6(), host.link_local()));
  return host;
}

void Lan::set_addresses(const std::string& name, const std::vector<std::string>& addresses) const {
  std::string lines;
  for (const std::string& address : addresses) {
    lines += address + " " + name + "\n";
  }
  write_to(folder_->file("hosts"), lines);
}

}  // namespace oblique::test
