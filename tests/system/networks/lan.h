#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/system/descriptor.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// This machine does not let us make networks; the message says what it refused.
class NoNamespaces : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A machine of a test's network: a network namespace with the loopback device and one cable, eth0,
/// to the switch, at which the test itself is. Programs that are started while an `Inside` lives
/// run on it.
class Host {
 public:
  const std::string& name() const { return name_; }
  /// Its addresses without their prefixes, as 10.77.0.2, fd77::2 and fe80::4d:2.
  std::string v4() const;
  std::string v6() const;
  std::string link_local() const;
  int network() const { return network_.number(); }

  /// The other end of its cable is pulled, or put back.
  void pull_cable() const;
  void plug_cable() const;
  /// So many of the packets that arrive at it are lost, at random.
  void lose_percent(int percent) const;
  /// Whatever it sends, or is sent to it, is lost: neither end of any connection learns of it.
  void lose_everything() const;
  void lose_nothing() const;
  /// From now on its addresses end in `last`, and those of before are gone.
  void renumber(int last);
  /// Runs a command of the shell on it to its end; what it wrote. Throws std::runtime_error when
  /// it fails.
  std::string run(const std::string& command) const;

 private:
  friend class Lan;
  Host(const TemporaryFolder& folder, std::string name, int last);

  const TemporaryFolder* folder_;
  std::string name_;
  int last_;
  protocol::Descriptor network_;
};

/// While it lives, this thread, and what it starts, is on that machine.
class Inside {
 public:
  explicit Inside(const Host& host);
  ~Inside();
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

 private:
  protocol::Descriptor before_;
};

/// A switch and machines at it, in user, mount and network namespaces of this process: they need no
/// root, have no names outside, and are gone with it and its children.
class Lan {
 public:
  /// Moves this process, which has one thread, to these namespaces. Throws NoNamespaces.
  explicit Lan(const TemporaryFolder& folder);
  ~Lan();
  Lan(const Lan&) = delete;
  Lan& operator=(const Lan&) = delete;

  /// A machine with the addresses 10.77.0.`last` and fd77::`last`.
  Host& add(const std::string& name, int last);
  /// From now on programs on all machines find these addresses under that name, and nothing under
  /// any other.
  void set_addresses(const std::string& name, const std::vector<std::string>& addresses) const;

 private:
  const TemporaryFolder* folder_;
  std::vector<std::unique_ptr<Host>> hosts_;
};

}  // namespace oblique::test
