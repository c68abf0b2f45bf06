#include "server/web/page/live_text.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLookEvery{100};
constexpr milliseconds kWordEvery{15'000};

std::string id_of(std::int64_t begun, std::uint64_t number) {
  return fmt::format("{}-{}", begun, number);
}

}  // namespace

class LiveText::Tab final : public HttpStream {
 public:
  Tab(LiveText& live, std::uint64_t seen) : live_(live), seen_(seen) {}

  bool has_news() override {
    live_.look();
    return live_.number_ != seen_ || Clock::now() - told_ >= kWordEvery;
  }
  std::string next() override {
    if (!has_news()) {
      return {};
    }
    told_ = Clock::now();
    return std::exchange(seen_, live_.number_) != live_.number_ ? live_.event_ : ": here\n\n";
  }

 private:
  LiveText& live_;
  std::uint64_t seen_;
  Clock::time_point told_ = Clock::now();
};

LiveText::LiveText(Look look, std::int64_t begun) : look_(std::move(look)), begun_(begun) {}

std::shared_ptr<HttpStream> LiveText::open(const std::string& seen) {
  return std::make_shared<Tab>(*this, seen == id_of(begun_, number_) ? number_ : 0);
}

void LiveText::look() {
  const auto now = Clock::now();
  if (now - looked_ < kLookEvery) {
    return;
  }
  looked_ = now;
  if (const auto text = look_()) {
    ++number_;
    event_ = fmt::format("id: {}\nevent: overview\ndata: {}\n\n", id_of(begun_, number_), *text);
  }
}

}  // namespace oblique::server
