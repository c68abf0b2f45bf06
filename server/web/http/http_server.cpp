#include "server/web/http/http_server.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>

#include "server/network/listener.h"

namespace oblique::server {
namespace {

/// Content-Security-Policy: our pages load files only from this server, and no page may embed them.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

MHD_Result take_header(void* into, MHD_ValueKind /*kind*/, const char* name, const char* value) {
  static_cast<HttpRequest*>(into)->headers.emplace(lower(name), value == nullptr ? "" : value);
  return MHD_YES;
}

MHD_Result take_field(void* into, MHD_ValueKind /*kind*/, const char* name, std::size_t name_bytes,
                      const char* value, std::size_t value_bytes) {
  auto& request = *static_cast<HttpRequest*>(into);
  const std::string key(name, name_bytes);
  const std::string text = value == nullptr ? std::string() : std::string(value, value_bytes);
  request.has_zero_bytes = request.has_zero_bytes || (key + text).find('\0') != std::string::npos;
  request.fields.try_emplace(key, text);
  return MHD_YES;
}

/// Returns whether the client has closed the connection or its sending half. Browsers do so when
/// they no longer need the answer, and libmicrohttpd does not watch a suspended connection.
bool is_gone(MHD_Connection* connection) {
  pollfd item{MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd,
              POLLRDHUP, 0};
  return ::poll(&item, 1, 0) > 0;
}

void add_headers(MHD_Response* response, const HttpAnswer& answer) {
  const auto add = [response](const char* name, const char* value) {
    MHD_add_response_header(response, name, value);
  };
  add(MHD_HTTP_HEADER_CONTENT_TYPE, answer.content_type.c_str());
  add(MHD_HTTP_HEADER_CONNECTION, "close");
  add(MHD_HTTP_HEADER_X_CONTENT_TYPE_OPTIONS, "nosniff");
  add("Content-Security-Policy", kContentPolicy);
  add("Cross-Origin-Resource-Policy", "same-origin");
  add("Cross-Origin-Opener-Policy", "same-origin");
  add("Cross-Origin-Embedder-Policy", "require-corp");
  add("Referrer-Policy", "no-referrer");
  for (const auto& [name, value] : answer.headers) {
    add(name.c_str(), value.c_str());
  }
  if (MHD_get_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL) == nullptr) {
    add(MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
  }
  if (answer.status == MHD_HTTP_METHOD_NOT_ALLOWED) {
    add(MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
  }
  if (answer.status == MHD_HTTP_SERVICE_UNAVAILABLE) {
    add(MHD_HTTP_HEADER_RETRY_AFTER, "1");
  }
}

}  // namespace

struct HttpServer::Exchange {
  HttpRequest request;
  PendingAnswer pending = {};
  bool is_answered = false;
};

struct HttpServer::Stream {
  Stream(HttpServer& of, MHD_Connection* to, HttpStream from)
      : server(of), connection(to), next(std::move(from)) {
    ++server.streams_;
  }
  ~Stream() { --server.streams_; }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  HttpServer& server;
  MHD_Connection* const connection;
  HttpStream next;
  std::string unsent = {};
  std::size_t sent = 0;  ///< number of first bytes of `unsent` that were sent
};

HttpServer::HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits,
                       HttpHandlers handlers)
    : names_(std::move(names)), limits_(limits), handlers_(std::move(handlers)) {
  const Listener listener(address.address, address.port);
  constexpr std::string_view kTcp = "tcp";
  url_ = "http" + listener.endpoint().substr(kTcp.size());
  const auto on_completed = [](void* /*self*/, MHD_Connection* /*connection*/, void** exchange,
                               MHD_RequestTerminationCode /*why*/) {
    delete static_cast<Exchange*>(std::exchange(*exchange, nullptr));
  };
  const int socket = ::fcntl(listener.descriptor(), F_DUPFD_CLOEXEC, 0);
  if (socket < 0) {
    throw std::runtime_error("cannot listen at " + url_ + ": " + std::strerror(errno));
  }
  // Uses poll, because with epoll libmicrohttpd 0.9.75 stops serving at the connection limit.
  daemon_ = MHD_start_daemon(
      MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_POLL | MHD_ALLOW_SUSPEND_RESUME, 0, nullptr,
      nullptr, &HttpServer::on_request, this, MHD_OPTION_LISTEN_SOCKET, socket,
      MHD_OPTION_NOTIFY_COMPLETED, static_cast<MHD_RequestCompletedCallback>(on_completed), nullptr,
      MHD_OPTION_NOTIFY_CONNECTION, &HttpServer::on_connection, this,
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, limits.bytes_of_connection, MHD_OPTION_CONNECTION_LIMIT,
      limits.connections, MHD_OPTION_CONNECTION_TIMEOUT, static_cast<unsigned>(limits.idle.count()),
      MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END);
  if (daemon_ == nullptr) {
    throw std::runtime_error("the HTTP server cannot start");
  }
}

HttpServer::~HttpServer() {
  is_stopping_ = true;
  wake();  // libmicrohttpd cannot stop while a connection is suspended
  MHD_stop_daemon(daemon_);
}

void HttpServer::wake() {
  ++wakes_;
  const Time now = handlers_.now();
  const std::lock_guard lock(mutex_);
  for (MHD_Connection* const connection : std::exchange(suspended_, {})) {
    MHD_resume_connection(connection);
  }
  for (const auto& [connection, transfer] : transfers_) {
    if (transfer.due <= now) {
      ::shutdown(transfer.socket, SHUT_RDWR);  // makes libmicrohttpd close the connection
    }
  }
}

/// Starts or ends the time limit of a connection. The idle time of libmicrohttpd begins again at
/// each byte, so a slow peer could stay for ever. The last free connection is freed again at once:
/// the other transfer that is due first, usually the oldest request without a whole head, ends.
void HttpServer::on_connection(void* self, MHD_Connection* connection, void** /*context*/,
                               MHD_ConnectionNotificationCode what) {
  auto& server = *static_cast<HttpServer*>(self);
  const Time due = server.due_for(0);
  const std::lock_guard lock(server.mutex_);
  if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
    server.transfers_.erase(connection);  // libmicrohttpd has not closed the socket yet
    return;
  }
  const int socket =
      MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
  try {
    const auto own = server.transfers_.insert_or_assign(connection, Transfer{socket, due}).first;
    Transfer* first = nullptr;
    for (auto at = server.transfers_.begin(); at != server.transfers_.end(); ++at) {
      const bool is_sooner = at->second.due < (first == nullptr ? Time::max() : first->due);
      first = at != own && is_sooner ? &at->second : first;
    }
    if (first != nullptr && server.transfers_.size() >= server.limits_.connections) {
      first->due = Time::max();
      ::shutdown(first->socket, SHUT_RDWR);  // makes libmicrohttpd close the connection
    }
  } catch (const std::exception&) {
    ::shutdown(socket, SHUT_RDWR);  // no memory is left, so the connection ends
  }
}

HttpServer::Time HttpServer::due_for(std::size_t bytes) const {
  return handlers_.now() + limits_.idle +
         std::chrono::seconds(bytes / limits_.least_bytes_a_second);
}

void HttpServer::set_due(MHD_Connection* connection, Time due) {
  const std::lock_guard lock(mutex_);
  transfers_.at(connection).due = due;
}

/// Suspends a connection until the next wake. `wakes` is the number of wakes before the answer was
/// polled. Does not suspend if there was another wake since then.
void HttpServer::suspend(MHD_Connection* connection, std::uint64_t wakes) {
  const std::lock_guard lock(mutex_);
  MHD_suspend_connection(connection);
  if (wakes_ == wakes) {
    suspended_.insert(connection);
  } else {
    MHD_resume_connection(connection);
  }
}

/// Called after the head of a request, after each part of its body, after the whole body, and when
/// the connection is resumed.
MHD_Result HttpServer::on_request(void* self, MHD_Connection* connection, const char* path,
                                  const char* method, const char* /*version*/, const char* upload,
                                  std::size_t* upload_bytes, void** exchange) {
  auto& server = *static_cast<HttpServer*>(self);
  try {
    if (*exchange == nullptr) {
      auto* const begun = new Exchange;  // deleted by the callback for completed requests
      *exchange = begun;
      begun->request.method = method;
      begun->request.path = path;
      return server.begin(connection, *begun);
    }
    Exchange& known = *static_cast<Exchange*>(*exchange);
    const std::size_t bytes = std::exchange(*upload_bytes, 0);
    if (known.is_answered) {
      return MHD_YES;
    }
    if (bytes == 0) {
      return server.answer(connection, known);
    }
    known.request.body.append(upload, bytes);
    return known.request.body.size() <= kMaxBodyBytes ? MHD_YES : MHD_NO;
  } catch (const std::exception&) {
    return MHD_NO;  // no memory is left, so the connection ends
  }
}

MHD_Result HttpServer::begin(MHD_Connection* connection, Exchange& exchange) {
  HttpRequest& request = exchange.request;
  MHD_get_connection_values(connection, MHD_HEADER_KIND, take_header, &request);
  MHD_get_connection_values_n(connection, MHD_GET_ARGUMENT_KIND, take_field, &request);
  auto refusal = refuse(request, names_);
  if (!refusal && request.method == "POST") {
    refusal = handlers_.refuse_change(request);
  }
  if (refusal) {
    return send(connection, exchange, *std::move(refusal));
  }
  const std::string length = request.header("content-length");
  // `refuse` has checked that the header is a number
  set_due(connection, due_for(length.empty() ? 0 : std::stoul(length)));
  return MHD_YES;
}

MHD_Result HttpServer::answer(MHD_Connection* connection, Exchange& exchange) {
  const std::uint64_t wakes = wakes_;  // read before the answer is polled, to miss no wake
  if (is_stopping_ || (exchange.pending && is_gone(connection))) {
    return MHD_NO;
  }
  set_due(connection, Time::max());
  if (auto answer = poll(exchange)) {
    return send(connection, exchange, *std::move(answer));
  }
  suspend(connection, wakes);
  return MHD_YES;
}

std::optional<HttpAnswer> HttpServer::poll(Exchange& exchange) const {
  try {
    if (!exchange.pending) {
      HttpOutcome outcome = handlers_.answer(exchange.request);
      if (auto* const answer = std::get_if<HttpAnswer>(&outcome)) {
        return std::move(*answer);
      }
      exchange.pending = std::get<PendingAnswer>(std::move(outcome));
    }
    return exchange.pending();
  } catch (const std::invalid_argument& error) {
    return error_answer(MHD_HTTP_BAD_REQUEST, error.what());
  } catch (const std::exception& error) {
    return error_answer(MHD_HTTP_INTERNAL_SERVER_ERROR, error.what());
  }
}

MHD_Result HttpServer::send(MHD_Connection* connection, Exchange& exchange, HttpAnswer answer) {
  if (answer.stream && streams_ >= limits_.streams) {
    answer = text_answer(MHD_HTTP_SERVICE_UNAVAILABLE, "too many pages are open: close some");
  }
  set_due(connection, answer.stream ? Time::max() : due_for(answer.body.size()));
  exchange.is_answered = true;
  exchange.pending = {};
  MHD_Response* const response = response_of(connection, answer);
  if (response == nullptr) {
    return MHD_NO;
  }
  add_headers(response, answer);
  const MHD_Result queued = MHD_queue_response(connection, answer.status, response);
  MHD_destroy_response(response);
  ++answers_[answer.status];
  return queued;
}

/// Returns a response that owns the body or the stream of `answer`; null if no memory is left.
MHD_Response* HttpServer::response_of(MHD_Connection* connection, HttpAnswer& answer) {
  if (answer.stream) {
    constexpr std::size_t kBlock = 4096;
    auto stream = std::make_unique<Stream>(*this, connection, std::move(answer.stream));
    MHD_Response* const response = MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, kBlock, &HttpServer::on_stream, stream.get(),
        [](void* owned) { delete static_cast<Stream*>(owned); });
    static_cast<void>(response != nullptr ? stream.release() : nullptr);
    return response;
  }
  struct Body {
    std::string bytes;
    std::shared_ptr<const void> until_sent;
  };
  auto body = std::make_unique<Body>(Body{std::move(answer.body), std::move(answer.until_sent)});
  MHD_Response* const response = MHD_create_response_from_buffer_with_free_callback_cls(
      body->bytes.size(), body->bytes.data(), [](void* owned) { delete static_cast<Body*>(owned); },
      body.get());
  static_cast<void>(response != nullptr ? body.release() : nullptr);
  return response;
}

/// Called when all earlier bytes of a stream were sent, and after a wake.
ssize_t HttpServer::on_stream(void* context, std::uint64_t /*position*/, char* into,
                              std::size_t most) {
  Stream& stream = *static_cast<Stream*>(context);
  HttpServer& server = stream.server;
  const std::uint64_t wakes = server.wakes_;  // read before `next` is called, to miss no wake
  if (server.is_stopping_ || is_gone(stream.connection)) {
    return MHD_CONTENT_READER_END_WITH_ERROR;
  }
  try {
    if (stream.sent == stream.unsent.size()) {
      auto next = stream.next();
      if (!next) {
        return MHD_CONTENT_READER_END_OF_STREAM;
      }
      stream.unsent = *std::move(next);
      stream.sent = 0;
    }
    if (stream.unsent.empty()) {
      server.suspend(stream.connection, wakes);
      return 0;
    }
  } catch (const std::exception&) {
    return MHD_CONTENT_READER_END_WITH_ERROR;
  }
  const std::size_t count = std::min(most, stream.unsent.size() - stream.sent);
  std::memcpy(into, stream.unsent.data() + stream.sent, count);
  stream.sent += count;
  return static_cast<ssize_t>(count);
}

}  // namespace oblique::server
