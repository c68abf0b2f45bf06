#include "tests/system/networks/study_on_lan.h"

#include <chrono>

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
}

void StudyOnLan::start_server(const std::string& address) {
  const Inside inside(*server_host_);
  server_ = std::make_unique<Server>(
      folder_, std::vector<std::string>{"--db", folder_.file("study.db"), "--listen", address,
                                        "--insecure"});
}

std::unique_ptr<Worker> StudyOnLan::worker_on(const Host& host) const {
  const Inside inside(host);
  return std::make_unique<Worker>(
      folder_, "tcp://" + server_name_ + ":7601",
      std::vector<std::string>{"--threads", "1", "--name", host.name()});
}

void StudyOnLan::start_workers(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    workers_.push_back(worker_on(*worker_hosts_.at(i)));
  }
}

void StudyOnLan::submit() {
  const Inside inside(*client_host_);
  client_ = std::make_unique<Process>(folder_, client_program(),
                                      submit_and_watch("tcp://" + server_name_ + ":7600"));
}

void StudyOnLan::goes_on_after(const std::function<void()>& fault, std::size_t workers) {
  if (server_ == nullptr) {
    start_server();
  }
  start_workers(workers);
  submit();
  wait_for_rows(database_, 1);
  fault();
  const auto mended = std::chrono::steady_clock::now();
  const double rows = database_.rows();
  ASSERT_LT(rows, kPoints) << "the study was too short for this fault";
  wait_for_rows(database_, rows + 1);
  print_measured("work goes on after",
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - mended).count());
  expect_completed(*client_, database_, [this] {
    return client_host_->run(client_program() + " workers --format json --server tcp://" +
                             server_name_ + ":7600");
  });
  for (const auto& worker : workers_) {
    EXPECT_FALSE(worker->exit_code()) << worker->err();
  }
}

}  // namespace oblique::test
