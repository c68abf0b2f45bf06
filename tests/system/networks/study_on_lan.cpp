#include "tests/system/networks/study_on_lan.h"

#include <chrono>

#include <unistd.h>

#include "tests/system/networks/small_study.h"

namespace oblique::test {
void StudyOnLan::SetUp() {
  try {
    lan_.emplace(folder_);
  } catch (const NoNamespaces& reason) {
    GTEST_SKIP() << reason.what();
  }
  server_host_ = &lan_->add("server", 2);
  worker_hosts_[0] = &lan_->add("worker1", 3);
  worker_hosts_[1] = &lan_->add("worker2", 4);
  client_host_ = &lan_->add("client", 5);
  server_name_ = server_host_->v4();
  keys_ = folder_.file("keys");
  const Outcome made = run_oblique(folder_, {"keygen", keys_});
  ASSERT_EQ(made.exit_code, 0) << made.err;
}

std::vector<std::string> StudyOnLan::access(const std::string& role) const {
  const std::string port = role == "worker" ? "7601" : "7600";
  std::vector<std::string> options{"--server", "tcp://" + server_name_ + ":" + port};
  if (!keys_.empty()) {
    options.insert(options.end(), {"--keys", keys_ + "/" + role + ".key"});
  }
  return options;
}

void StudyOnLan::start_server(const std::string& address) {
  const Inside inside(*server_host_);
  std::vector<std::string> arguments{"--db", folder_.file("study.db"), "--listen", address};
  if (keys_.empty()) {
    arguments.emplace_back("--insecure");
  } else {
    arguments.insert(arguments.end(), {"--keys", keys_ + "/server.key"});
  }
  server_ = std::make_unique<Server>(folder_, arguments);
}

std::unique_ptr<Process> StudyOnLan::worker_on(const Host& host) const {
  const Inside inside(host);
  auto arguments = access("worker");
  arguments.insert(arguments.end(), {"--threads", "1", "--name", host.name(), "--stop-with-parent",
                                     std::to_string(getpid())});
  return std::make_unique<Process>(folder_, worker_program(), arguments);
}

std::unique_ptr<Process> StudyOnLan::client(std::vector<std::string> arguments) const {
  const Inside inside(*client_host_);
  const auto options = access("client");
  arguments.insert(arguments.end(), options.begin(), options.end());
  return std::make_unique<Process>(folder_, client_program(), arguments);
}

void StudyOnLan::start_workers(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    workers_.push_back(worker_on(*worker_hosts_.at(i)));
  }
}

void StudyOnLan::goes_on_after(const std::function<void()>& fault, std::size_t workers) {
  if (server_ == nullptr) {
    start_server();
  }
  start_workers(workers);
  if (client_ == nullptr) {
    client_ = client(submit_and_watch());
  }
  wait_for_rows(database_, 1);
  fault();
  const auto mended = std::chrono::steady_clock::now();
  const double rows = database_.rows();
  ASSERT_LT(rows, kManyPoints) << "the study was too short for this fault";
  wait_for_rows(database_, rows + 1);
  print_measured("work goes on after", seconds_since(mended));
  expect_completed(*client_, database_, [this] {
    return client({"workers", "--format", "json"})->outcome().out;
  });
  for (const auto& worker : workers_) {
    EXPECT_FALSE(worker->exit_code()) << worker->err();
  }
}

}  // namespace oblique::test
