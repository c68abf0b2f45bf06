#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/networks/lan.h"

namespace oblique::test {

/// A server, two workers and a client, each on a machine of its own, and a study that takes
/// seconds. Skips where no networks can be made.
class StudyOnLan : public ::testing::Test {
 protected:
  void SetUp() override;

  /// The options by which a client or worker (`role`) reaches the server.
  std::vector<std::string> access(const std::string& role) const;

  /// At the ports that it has by default; `::` are all addresses of both families.
  void start_server(const std::string& address = "::");
  void start_workers(std::size_t count = 2);
  /// A worker on that machine, under the name of its machine.
  std::unique_ptr<Process> worker_on(const Host& host) const;
  /// `oblique` with these arguments, and how the server is reached, on the client's machine.
  std::unique_ptr<Process> client(std::vector<std::string> arguments) const;

  /// Starts what does not run yet of all these. Once points are stored `fault` happens, at the end
  /// of which what was broken is mended; then the study is completed (small_study.h) and all
  /// workers still run. Prints how soon rows came again.
  void goes_on_after(const std::function<void()>& fault, std::size_t workers = 2);

  TemporaryFolder folder_;
  std::optional<Lan> lan_;
  Host* server_host_ = nullptr;
  std::array<Host*, 2> worker_hosts_{};
  Host* client_host_ = nullptr;

  /// How workers and clients write where the server is; its IPv4 address to begin with.
  std::string server_name_;
  std::string keys_;  ///< folder of the keys that all programs have; empty: they have none

  std::unique_ptr<Server> server_;
  std::vector<std::unique_ptr<Process>> workers_;
  std::unique_ptr<Process> client_;
  Database database_{folder_.file("study.db")};
};

}  // namespace oblique::test
