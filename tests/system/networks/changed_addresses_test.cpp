// Machines that get other addresses while a study is solved, and addresses of IPv6.
#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "tests/system/networks/small_study.h"
#include "tests/system/networks/study_on_lan.h"

namespace oblique::test {
namespace {

using ChangedAddresses = StudyOnLan;

TEST_F(ChangedAddresses, TheMachineOfTheOnlyWorkerGetsAnotherAddress) {
  goes_on_after([this] { worker_hosts_[0]->renumber(13); }, 1);
}

TEST_F(ChangedAddresses, TheClientsMachineGetsAnotherAddress) {
  start_server();
  client_ = client(submit_and_watch());
  const auto says = [this](const std::string& words) {
    return client_->err().find(words) != std::string::npos;
  };
  wait_until("it watches", [&] { return says("waits for a worker"); });
  client_host_->renumber(15);
  const auto renumbered = std::chrono::steady_clock::now();
  wait_until("it is answered again", [&] { return says("answers again"); });
  print_measured("the client is answered again after", seconds_since(renumbered));
  goes_on_after([] {});
}

TEST_F(ChangedAddresses, TheServersMachineGetsAnotherAddressUnderItsName) {
  lan_->set_addresses("coordinator", {server_host_->v4()});
  server_name_ = "coordinator";
  goes_on_after([this] {
    server_host_->renumber(12);
    lan_->set_addresses("coordinator", {server_host_->v4()});
  });
}

TEST_F(ChangedAddresses, ANameThatHasNoneIsSaidToHaveNone) {
  server_name_ = "nowhere";
  const Outcome asked = client({"status", "--timeout", "0.2"})->outcome();
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_NE(asked.err.find("no address is known here for the name nowhere"), std::string::npos)
      << asked.err;
}

using IPv6 = StudyOnLan;

TEST_F(IPv6, CarriesAStudyFromEndToEnd) {
  server_name_ = "[" + server_host_->v6() + "]";
  goes_on_after([] {});
}

TEST_F(IPv6, CarriesAStudyOverLinkLocalAddresses) {
  const std::string address = server_host_->link_local() + "%eth0";
  server_name_ = "[" + address + "]";
  start_server(address);
  goes_on_after([] {});
}

TEST_F(IPv6, IsFoundByName) {
  lan_->set_addresses("coordinator", {server_host_->v6()});
  server_name_ = "coordinator";
  goes_on_after([] {});
}

TEST_F(IPv6, IsTriedWhereNobodyAnswersAtTheAddressOfIPv4OfTheSameName) {
  lan_->set_addresses("coordinator", {server_host_->v4(), server_host_->v6()});
  server_name_ = "coordinator";
  start_server(server_host_->v6());
  goes_on_after([] {});
}

}  // namespace
}  // namespace oblique::test
