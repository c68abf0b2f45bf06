// Lines that break, lose and stall while a study is solved: it is completed all the same.
#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>

#include "tests/system/networks/study_on_lan.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class BrokenLines : public StudyOnLan {
 protected:
  static void pull_for(const Host& host, milliseconds time) {
    host.pull_cable();
    std::this_thread::sleep_for(time);
    host.plug_cable();
  }
};

TEST_F(BrokenLines, TheServersCableIsPulledForTenSeconds) {
  goes_on_after([this] { pull_for(*server_host_, seconds(10)); });
}

TEST_F(BrokenLines, TheCableOfTheOnlyWorkerIsPulledForTenSeconds) {
  goes_on_after([this] { pull_for(*worker_hosts_[0], seconds(10)); }, 1);
}

TEST_F(BrokenLines, TheServersCableIsPulledForLessThanAWorkersLeasesLast) {
  goes_on_after([this] { pull_for(*server_host_, milliseconds(1500)); });
}

TEST_F(BrokenLines, OfAHundredPacketsFiveAreLostBothWays) {
  for (const Host* host : {server_host_, worker_hosts_[0], worker_hosts_[1], client_host_}) {
    host->lose_percent(5);
  }
  goes_on_after([] {});
}

TEST_F(BrokenLines, AWorkerIsCutOffWithoutAWordAndStartedAgain) {
  goes_on_after([this] {
    worker_hosts_[0]->lose_everything();
    workers_[0]->send(SIGKILL);
    workers_[0]->wait();
    worker_hosts_[0]->lose_nothing();  // the server still has the connection of the one before
    workers_[0] = worker_on(*worker_hosts_[0]);
  });
}

TEST_F(BrokenLines, TheServerIsCutOffWithoutAWordForTenSeconds) {
  goes_on_after([this] {
    server_host_->lose_everything();
    std::this_thread::sleep_for(seconds(10));
    server_host_->lose_nothing();
  });
}

TEST_F(BrokenLines, TheServersMachineGoesDownWithoutAWordAndComesBack) {
  goes_on_after([this] {
    server_host_->pull_cable();
    server_->process().send(SIGKILL);
    server_->process().wait();
    std::this_thread::sleep_for(seconds(4));
    server_host_->plug_cable();
    start_server();
  });
}

}  // namespace
}  // namespace oblique::test
