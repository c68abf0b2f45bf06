#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "server/web/answers/service_line.h"
#include "server/web/page/talks.h"

namespace oblique::server {

/// Studies that are made to be looked at, and deleted when nobody has for some seconds. They come
/// before all others, are small and few. One whose server ended meanwhile is found by the next one,
/// by its name and priority. Of the HTTP server's thread.
class Looks {
 public:
  using Clock = std::chrono::steady_clock;

  /// A study that nobody has looked at for `kept` goes.
  Looks(ServiceLine& service, std::chrono::milliseconds kept) : service_(service), kept_(kept) {}

  /// A study as the body says, under a name that follows from its recipe, so that the same is asked
  /// for twice and solved once. Throws std::invalid_argument for what is none, or too large.
  Talk begin(const HttpQuestion& question);
  /// The study is kept as one of the name that the body says, and goes behind others; who asks for
  /// that again, also at the same time, is told the same. An answer at once: it is none that is
  /// looked at, or another name was first. Throws std::invalid_argument for a body without a name.
  std::variant<HttpAnswer, Talk> keep(std::uint64_t study, const HttpQuestion& question);
  /// Somebody has asked for something of that study.
  void seen(std::uint64_t study);
  /// Deletes what nobody looks at. Gives the time after which it wants to be called again; none:
  /// there is nothing to look after.
  std::optional<std::chrono::milliseconds> tick();

  static constexpr std::uint64_t kMostPoints = std::uint64_t{129} * 129;
  static constexpr std::size_t kMost = 4;  ///< at a time; one more drops that seen longest ago

 private:
  struct Look {
    protocol::SubmitRequest request;
    Clock::time_point seen;
    std::optional<std::uint64_t> going{};  ///< number of the request that deletes it
    std::string kept_as = {};              ///< a name that it is being given
  };

  void add(std::uint64_t study, const protocol::SubmitRequest& request);
  void is_kept(std::uint64_t study);
  void find_leavings();
  void drop(Look& look);

  ServiceLine& service_;
  std::chrono::milliseconds kept_;
  std::map<std::uint64_t, Look> looks_;       // by number of the study
  std::deque<std::uint64_t> kept_studies_;    // that were looked at, the last ones
  std::optional<std::uint64_t> searching_{};  // number of the request that lists studies
  bool has_searched_ = false;
  std::uint64_t last_number_ = std::uint64_t{1} << 62U;  // of requests that no browser made
};

}  // namespace oblique::server
