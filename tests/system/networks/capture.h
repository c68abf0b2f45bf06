#pragma once

#include <string>
#include <thread>

#include "proto/system/descriptor.h"
#include "tests/system/networks/lan.h"

namespace oblique::test {

/// Everything that goes through the cable of a machine, in both directions, as the switch sees it.
class Capture {
 public:
  /// Throws std::runtime_error where the system gives no such socket.
  explicit Capture(const Host& host);
  ~Capture();
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  /// What went by until now, one packet after another, with all their headers. Ends the capture.
  const std::string& bytes();

 private:
  void run(const std::stop_token& stop);

  protocol::Descriptor socket_;
  std::string bytes_;
  std::jthread thread_;  ///< last, as it uses the others
};

}  // namespace oblique::test
