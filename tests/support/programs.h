#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/reserved_port.h"

namespace oblique::test {

// Paths of the programs under test.
std::string client_program();
std::string server_program();
std::string worker_program();

/// Runs `oblique` with `arguments` to its end, in `folder` or in a temporary folder.
Outcome run_oblique(const TemporaryFolder& folder, const std::vector<std::string>& arguments);
Outcome run_oblique(const std::vector<std::string>& arguments);

/// An `oblique-server`. The constructor waits until the server is ready.
class Server {
 public:
  /// Listens on loopback at ports that the system picks. The ports stay reserved while this object,
  /// or a Server constructed from it, exists.
  Server(const TemporaryFolder& folder, const std::string& database,
         const Environment& environment = {});
  /// Listens at the ports of `before`, which has ended.
  Server(const TemporaryFolder& folder, const std::string& database, const Server& before,
         const Environment& environment = {});
  /// Starts with these arguments, which must contain the database and the addresses.
  Server(const TemporaryFolder& folder, const std::vector<std::string>& arguments,
         const Environment& environment = {});

  const std::string& worker_url() const { return worker_url_; }
  const std::string& client_url() const { return client_url_; }
  /// Address of the page, for example http://127.0.0.1:7602.
  const std::string& http_url() const { return http_url_; }
  Process& process() { return *process_; }

 private:
  struct Ports {
    ReservedPort worker;
    ReservedPort client;
  };
  std::vector<std::string> arguments(const std::string& database) const;
  void start(const TemporaryFolder& folder, std::vector<std::string> arguments,
             const Environment& environment);

  std::shared_ptr<const Ports> ports_;
  std::string worker_url_;
  std::string client_url_;
  std::string http_url_;
  std::optional<Process> process_;
};

/// An `oblique-worker` that connects to `server_url`.
class Worker : public Process {
 public:
  Worker(const TemporaryFolder& folder, const std::string& server_url,
         const std::vector<std::string>& arguments = {}, const Environment& environment = {});
};

}  // namespace oblique::test
