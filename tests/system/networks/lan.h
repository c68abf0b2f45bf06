#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/system/descriptor.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// Thrown if the system refuses to create namespaces; the message contains the reason.
class NoNamespaces : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A virtual machine of a test: a network namespace with loopback and one virtual cable, eth0, to
/// the switch. The test is connected to the switch. Programs run on the machine if they are started
/// while an `Inside` for it exists.
class Host {
 public:
  const std::string& name() const { return name_; }
  /// The machine's addresses without prefix length, such as 10.77.0.2, fd77::2 and fe80::4d:2.
  std::string v4() const;
  std::string v6() const;
  std::string link_local() const;
  int network() const { return network_.number(); }

  /// Unplugs or plugs in the machine's cable at the switch.
  void pull_cable() const;
  void plug_cable() const;
  /// Drops `percent` percent of the arriving packets at random.
  void lose_percent(int percent) const;
  /// Drops all packets from and to this machine. Peers get no notice that the machine is
  /// unreachable.
  void lose_everything() const;
  void lose_nothing() const;
  /// Changes the machine's addresses to 10.77.0.`last` and fd77::`last`.
  void renumber(int last);
  /// Runs a shell command on the machine and returns its output. Throws std::runtime_error if the
  /// command fails.
  std::string run(const std::string& command) const;

 private:
  friend class Lan;
  Host(const TemporaryFolder& folder, std::string name, int last);

  const TemporaryFolder* folder_;
  std::string name_;
  int last_;
  protocol::Descriptor network_;
};

/// While this object exists, this thread and the programs that it starts run on `host`.
class Inside {
 public:
  explicit Inside(const Host& host);
  ~Inside();
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

 private:
  protocol::Descriptor before_;
};

/// A switch with machines, in user, mount and network namespaces of this process. These namespaces
/// need no root, are invisible to other processes, and end with this process and its children.
class Lan {
 public:
  /// Moves this process, which must have one thread, to new namespaces. Throws NoNamespaces.
  explicit Lan(const TemporaryFolder& folder);
  ~Lan();
  Lan(const Lan&) = delete;
  Lan& operator=(const Lan&) = delete;

  /// Adds a machine with the addresses 10.77.0.`last` and fd77::`last`.
  Host& add(const std::string& name, int last);
  /// Makes `name` resolve to `addresses` on all machines. No other name resolves.
  void set_addresses(const std::string& name, const std::vector<std::string>& addresses) const;

 private:
  const TemporaryFolder* folder_;
  std::vector<std::unique_ptr<Host>> hosts_;
};

}  // namespace oblique::test
