#include "server/web/http/http_server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <microhttpd.h>
#include <poll.h>
#include <sys/socket.h>

#include "proto/system/descriptor.h"
#include "server/network/listener.h"
#include "server/web/http/http_parts.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// While the system has no descriptor for a new connection, it is asked again after so long.
constexpr milliseconds kAcceptPause{100};
/// Who waits for an answer is asked for again at least so often.
constexpr milliseconds kLongestWait{200};
/// New connections in one turn.
constexpr int kMostAccepted = 64;

}  // namespace

class HttpServer::Parts {
 public:
  Parts(const HttpAddress& address, OwnNames names, const HttpLimits& limits, Answer answer,
        Rules rules)
      : names_(std::move(names)),
        limits_(limits),
        answer_(std::move(answer)),
        rules_(std::move(rules)),
        listener_(address.address, address.port),
        daemon_(
            MHD_start_daemon(MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET | MHD_ALLOW_SUSPEND_RESUME, 0,
                             nullptr, nullptr, &Parts::asked, this, MHD_OPTION_NOTIFY_CONNECTION,
                             &Parts::noticed, this, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                             limits.bytes_of_connection, MHD_OPTION_CONNECTION_LIMIT,
                             static_cast<unsigned>(2 * limits.connections + limits.streams),
                             MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END)) {
    if (daemon_ == nullptr) {
      throw std::runtime_error("the HTTP server cannot start");
    }
    thread_ = std::thread([this] { run(); });
  }
  ~Parts() {
    is_stopping_ = true;
    wake_up_.wake();
    thread_.join();
    MHD_stop_daemon(daemon_);
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  const std::string& endpoint() const { return listener_.endpoint(); }
  void wake() const { wake_up_.wake(); }

 private:
  struct Peer {
    int descriptor = -1;
    std::string address;
    Clock::time_point since;
    std::optional<Clock::time_point> asked;
    bool waits = false;     // suspended
    bool answered = false;  // an answer is under way
    Asked request = {};     // once its head has come
    std::shared_ptr<HttpStream> stream = {};
    std::string unsent = {};  // of the stream
  };
  using Peers = std::map<MHD_Connection*, Peer>;
  using StreamPlace = std::pair<Parts*, MHD_Connection*>;

  void run() {
    std::array<pollfd, 3> items{
        {{MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd, POLLIN, 0},
         {wake_up_.descriptor(), POLLIN, 0},
         {listener_.descriptor(), POLLIN, 0}}};
    while (!is_stopping_) {
      const auto now = rules_.now();
      const bool accepts = now >= accept_again_;
      ::poll(items.data(), accepts ? items.size() : items.size() - 1,
             static_cast<int>(wait_from(now).count()));
      wake_up_.clear();
      turn_again_ = rules_.turn();
      end_overdue(rules_.now());
      end_gone();
      accept_all();
      ask_again();
      MHD_run(daemon_);
    }
    // None may be suspended at the end.
    ask_again();
    MHD_run(daemon_);
  }

  milliseconds wait_from(Clock::time_point now) const {
    MHD_UNSIGNED_LONG_LONG limit_ms = 0;
    auto until = now + std::min(limits_.longest, turn_again_.value_or(limits_.longest));
    if (MHD_get_timeout(daemon_, &limit_ms) == MHD_YES) {
      until = std::min(until, now + milliseconds(limit_ms));
    }
    until = now < accept_again_ ? std::min(until, accept_again_) : until;
    for (const auto& [connection, peer] : peers_) {
      until = is_quiet_stream(peer) ? until : std::min(until, peer.since + limits_.longest);
      until = peer.waits ? std::min(until, now + kLongestWait) : until;
    }
    return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(until - now));
  }

  void accept_all() {
    for (int i = 0; i < kMostAccepted; ++i) {
      Listener::Accepted accepted = listener_.accept();
      if (!accepted.socket.is_open()) {
        const bool lacks_room = errno == EMFILE || errno == ENFILE || errno == ENOBUFS;
        accept_again_ = lacks_room ? rules_.now() + kAcceptPause : accept_again_;
        return;
      }
      const int descriptor = accepted.socket.release();
      accepted_host_ = host_of(accepted.address);
      make_room_for(accepted_host_);
      sockaddr_in6 from{};
      socklen_t bytes = sizeof from;
      ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&from), &bytes);
      // It is closed there whether it was taken or not.
      MHD_add_connection(daemon_, descriptor, reinterpret_cast<sockaddr*>(&from), bytes);
      MHD_run(daemon_);  // so that it counts, and those that made room do not
    }
  }

  void make_room_for(const std::string& address) {
    std::map<std::string, std::size_t> counts;
    std::size_t connections = 0;
    for (const auto& [connection, peer] : peers_) {
      if (!peer.stream) {
        ++connections;
        ++counts[peer.address];
      }
    }
    const auto most = std::max_element(
        counts.begin(), counts.end(),
        [](const auto& one, const auto& other) { return one.second < other.second; });
    if (counts[address] >= limits_.connections_of_one_address) {
      end_oldest_of(address);
    } else if (connections >= limits_.connections) {
      end_oldest_of(most->first);
    }
  }

  void end_oldest_of(const std::string& address) {
    auto oldest = peers_.end();
    for (auto peer = peers_.begin(); peer != peers_.end(); ++peer) {
      if (peer->second.address == address && !peer->second.stream &&
          (oldest == peers_.end() || peer->second.since < oldest->second.since)) {
        oldest = peer;
      }
    }
    if (oldest != peers_.end()) {
      ++counts_.ended_for_others;
      end(oldest, kCrowded);
    }
  }

  void end_overdue(Clock::time_point now) {
    for (auto peer = peers_.begin(); peer != peers_.end();) {
      const auto this_one = peer++;
      if (!is_quiet_stream(this_one->second) && now - this_one->second.since >= limits_.longest) {
        ++counts_.ended_as_slow;
        end(this_one, kTooSlow);
      }
    }
  }

  /// The library does not look at a connection that waits.
  void end_gone() {
    std::vector<int> descriptors;
    for (const auto& [connection, peer] : peers_) {
      descriptors.push_back(peer.waits ? peer.descriptor : -1);
    }
    auto peer = peers_.begin();
    for (const bool gone : who_is_gone(descriptors)) {
      const auto this_one = peer++;
      if (gone) {
        end(this_one, {});
      }
    }
  }

  /// It is ours no more; the library finds that its socket has ended.
  void end(Peers::iterator peer, std::string_view last_words) {
    if (!peer->second.answered) {
      static_cast<void>(::send(peer->second.descriptor, last_words.data(), last_words.size(),
                               MSG_DONTWAIT | MSG_NOSIGNAL));
    }
    ::shutdown(peer->second.descriptor, SHUT_RDWR);
    if (peer->second.waits) {
      MHD_resume_connection(peer->first);
    }
    tell_gone(peer->second);
    peers_.erase(peer);
  }

  void tell_gone(const Peer& peer) const {
    if (peer.asked && !peer.answered) {
      rules_.gone(peer.request.question.number);
    }
  }

  /// A stream whose peer has taken all that there was.
  static bool is_quiet_stream(const Peer& peer) { return peer.stream && peer.waits; }

  void ask_again() {
    for (auto& [connection, peer] : peers_) {
      if (peer.waits && (is_stopping_ || !peer.stream || peer.stream->has_news())) {
        peer.waits = false;
        peer.since = peer.stream ? rules_.now() : peer.since;
        MHD_resume_connection(connection);
      }
    }
  }

  /// The library asks for more of a stream, when what it has was sent.
  static ssize_t stream_on(void* context, std::uint64_t /*position*/, char* into,
                           std::size_t most) {
    const auto& [parts, connection] = *static_cast<StreamPlace*>(context);
    const auto found = parts->peers_.find(connection);
    if (found == parts->peers_.end() || parts->is_stopping_) {
      return MHD_CONTENT_READER_END_OF_STREAM;
    }
    Peer& peer = found->second;
    peer.since = parts->rules_.now();
    if (peer.unsent.empty()) {
      peer.unsent = peer.stream->next();
      peer.waits = peer.unsent.empty();
    }
    if (peer.waits) {
      MHD_suspend_connection(connection);
      return 0;
    }
    const std::size_t count = std::min(most, peer.unsent.size());
    std::memcpy(into, peer.unsent.data(), count);
    peer.unsent.erase(0, count);
    return static_cast<ssize_t>(count);
  }

  static void noticed(void* self, MHD_Connection* connection, void** /*context*/,
                      MHD_ConnectionNotificationCode what) {
    Parts& parts = *static_cast<Parts*>(self);
    if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
      if (const auto peer = parts.peers_.find(connection); peer != parts.peers_.end()) {
        parts.tell_gone(peer->second);
        parts.peers_.erase(peer);
      }
      return;
    }
    const int descriptor =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
    parts.peers_[connection] = {descriptor, parts.accepted_host_, parts.rules_.now(), {}};
  }

  static MHD_Result asked(void* self, MHD_Connection* connection, const char* url,
                          const char* method, const char* /*version*/, const char* upload,
                          std::size_t* upload_bytes, void** state) {
    Parts& parts = *static_cast<Parts*>(self);
    const auto peer = parts.peers_.find(connection);
    if (peer == parts.peers_.end()) {
      return MHD_NO;  // it was ended
    }
    const std::size_t bytes = std::exchange(*upload_bytes, 0);
    try {
      if (std::exchange(*state, &parts) == nullptr) {  // the head has come
        return parts.head_came(peer, method, url);
      }
      std::string& body = peer->second.request.question.body;
      if (bytes == 0) {
        return parts.answer(peer);
      }
      if (peer->second.answered || body.size() + bytes > kMostBodyBytes) {
        return peer->second.answered ? MHD_YES : MHD_NO;
      }
      body.append(upload, bytes);
      return MHD_YES;
    } catch (const std::exception&) {
      return MHD_NO;  // no memory: the connection ends
    }
  }

  MHD_Result head_came(Peers::iterator peer, const char* method, const char* path) {
    Asked& request = peer->second.request;
    request = asked_on(peer->first, method, path);
    request.head.takes_changes = rules_.takes_changes(request.question.path);
    request.question.number = ++last_number_;
    request.question.counts = &counts_;
    if (const auto refusal = objection_to(request.head, names_)) {
      return send(peer, {refusal->status, kPlainText, refusal->sentence + "\n"});
    }
    if (request.question.method == "POST") {
      if (const auto objection = rules_.objection(request.question)) {
        return send(peer, *objection);
      }
    }
    return MHD_YES;
  }

  MHD_Result answer(Peers::iterator peer) {
    const auto now = rules_.now();
    if (!peer->second.asked) {
      peer->second.asked = now;
    }
    HttpQuestion& question = peer->second.request.question;
    question.waited = std::chrono::duration_cast<milliseconds>(now - *peer->second.asked);
    counts_.connections = peers_.size();
    if (is_stopping_) {
      return MHD_NO;
    }
    if (auto answer = answer_(question)) {
      return send(peer, std::move(*answer));
    }
    peer->second.waits = true;
    MHD_suspend_connection(peer->first);
    return MHD_YES;
  }

  MHD_Result send(Peers::iterator peer, HttpAnswer answer) {
    const auto streams = static_cast<std::size_t>(std::count_if(
        peers_.begin(), peers_.end(), [](const auto& other) { return other.second.stream; }));
    if (answer.stream && streams >= limits_.streams) {
      return send(peer, {MHD_HTTP_SERVICE_UNAVAILABLE, kPlainText,
                         "too many pages are open already: close some\n"});
    }
    MHD_Response* const response =
        answer.stream ? streaming(peer->first) : buffered(std::move(answer.body));
    if (response == nullptr) {
      return MHD_NO;
    }
    add_headers(response, answer);
    peer->second.stream = answer.stream;
    const MHD_Result queued = MHD_queue_response(peer->first, answer.status, response);
    MHD_destroy_response(response);
    peer->second.answered = true;
    ++counts_.answers[answer.status];
    return queued;
  }

  MHD_Response* streaming(MHD_Connection* connection) {
    constexpr std::size_t kBlock = 4096;
    auto place = std::make_unique<StreamPlace>(this, connection);
    MHD_Response* const response = MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, kBlock, &Parts::stream_on, place.get(),
        [](void* context) { delete static_cast<StreamPlace*>(context); });
    if (response != nullptr) {
      static_cast<void>(place.release());  // the library deletes it
    }
    return response;
  }

  static constexpr const char* kPlainText = "text/plain; charset=utf-8";

  OwnNames names_;
  HttpLimits limits_;
  Answer answer_;
  Rules rules_;
  Listener listener_;
  protocol::WakeUp wake_up_;
  std::atomic<bool> is_stopping_ = false;
  // Of the thread, from here on.
  Peers peers_;
  HttpCounts counts_;
  std::uint64_t last_number_ = 0;
  std::optional<milliseconds> turn_again_ = milliseconds(0);
  std::string accepted_host_;  // of the connection that is being taken
  Clock::time_point accept_again_{};
  MHD_Daemon* daemon_;
  std::thread thread_;  // last: it uses all the others
};

HttpServer::HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits,
                       Answer answer, Rules rules)
    : parts_(std::make_unique<Parts>(address, std::move(names), limits, std::move(answer),
                                     std::move(rules))) {}
HttpServer::~HttpServer() = default;

std::string HttpServer::url() const {
  constexpr std::string_view kTcp = "tcp";
  return "http" + parts_->endpoint().substr(kTcp.size());
}

void HttpServer::wake() const {
  parts_->wake();
}

}  // namespace oblique::server
