#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>

#include "tests/server/web/raw_http.h"

namespace oblique::bench {

/// Asks a server for its metrics at an interval, as Prometheus does, on a thread of its own.
class Scraper {
 public:
  /// No interval: never.
  Scraper(std::string http_url, std::chrono::milliseconds interval)
      : http_url_(std::move(http_url)), interval_(interval), thread_([this] { run(); }) {}
  ~Scraper() {
    stopping_ = true;
    thread_.join();
  }
  Scraper(const Scraper&) = delete;
  Scraper& operator=(const Scraper&) = delete;

  std::uint64_t scrapes() const { return scrapes_; }

 private:
  void run() {
    auto next = std::chrono::steady_clock::now();
    while (!stopping_ && interval_.count() > 0) {
      if (std::chrono::steady_clock::now() >= next) {
        scrapes_ += server::status_of_answer(server::get(http_url_, "/metrics")) == 200 ? 1 : 0;
        next += interval_;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  std::string http_url_;
  std::chrono::milliseconds interval_;
  std::atomic<std::uint64_t> scrapes_ = 0;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;  // last: it uses all the others
};

}  // namespace oblique::bench
