#include "tests/support/programs.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace oblique::test {
namespace {

std::string read_line(int descriptor) {
  std::string line;
  char byte = 0;
  while (read(descriptor, &byte, 1) == 1 && byte != '\n') {
    line += byte;
  }
  return line;
}

}  // namespace

std::string client_program() {
  return OBLIQUE_CLIENT;
}
std::string server_program() {
  return OBLIQUE_SERVER;
}
std::string worker_program() {
  return OBLIQUE_WORKER;
}

Outcome run_oblique(const TemporaryFolder& folder, const std::vector<std::string>& arguments) {
  return Process(folder, client_program(), arguments).outcome();
}

Outcome run_oblique(const std::vector<std::string>& arguments) {
  return run_oblique(TemporaryFolder(), arguments);
}

Server::Server(const TemporaryFolder& folder, const std::string& database,
               const Environment& environment)
    : ports_(std::make_shared<Ports>()) {
  start(folder, arguments(database), environment);
}

Server::Server(const TemporaryFolder& folder, const std::string& database, const Server& before,
               const Environment& environment)
    : ports_(before.ports_) {
  start(folder, arguments(database), environment);
}

Server::Server(const TemporaryFolder& folder, const std::vector<std::string>& arguments,
               const Environment& environment) {
  start(folder, arguments, environment);
}

std::vector<std::string> Server::arguments(const std::string& database) const {
  return {"--db",          database,
          "--worker-port", ports_->worker.number(),
          "--client-port", ports_->client.number()};
}

void Server::start(const TemporaryFolder& folder, std::vector<std::string> arguments,
                   const Environment& environment) {
  std::array<int, 2> ready{};
  if (pipe2(ready.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("pipe: " + std::string(std::strerror(errno)));
  }
  arguments.insert(arguments.end(), {"--http", "127.0.0.1:0", "--ready-fd", "3",
                                     "--stop-with-parent", std::to_string(getpid())});
  // With a drain time of 0 the server ends at once.
  Environment with_drain{{"OBLIQUE_SERVER_DRAIN", "0"}};
  for (const auto& [name, value] : environment) {
    with_drain[name] = value;
  }
  process_.emplace(folder, server_program(), arguments, with_drain, ready[1]);
  close(ready[1]);
  const auto urls = nlohmann::json::parse(read_line(ready[0]), nullptr, false);
  close(ready[0]);
  if (!urls.is_object()) {
    throw std::runtime_error("the server did not start: " + process_->err());
  }
  worker_url_ = urls.at("worker");
  client_url_ = urls.at("client");
  http_url_ = urls.at("http");
}

namespace {

std::vector<std::string> worker_arguments(const std::string& server_url,
                                          const std::vector<std::string>& more) {
  std::vector<std::string> all{"--server", server_url, "--stop-with-parent",
                               std::to_string(getpid())};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace

Worker::Worker(const TemporaryFolder& folder, const std::string& server_url,
               const std::vector<std::string>& arguments, const Environment& environment)
    : Process(folder, worker_program(), worker_arguments(server_url, arguments), environment) {}

}  // namespace oblique::test
