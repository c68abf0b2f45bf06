#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include <microhttpd.h>

#include "server/web/http/http_message.h"
#include "server/web/http/request_rules.h"

namespace oblique::server {

/// Bounds on what peers can make the HTTP server hold. A connection is for one request.
struct HttpLimits {
  unsigned connections = 256;                ///< more wait to be accepted
  unsigned connections_of_one_address = 64;  ///< more are closed
  unsigned streams = 32;
  /// A connection's memory for request line, headers and the headers of the answer.
  std::size_t bytes_of_connection = std::size_t{16} * 1024;
  /// A connection that neither sends nor takes anything for this long is closed; not while the
  /// server has nothing to say. The head of a request must come within this time of connecting.
  std::chrono::seconds idle{10};
  /// Bodies and answers, but for streams, have `idle` and a second for that many bytes.
  std::size_t least_bytes_a_second = std::size_t{4} * 1024;
};

/// Called on the server's thread.
struct HttpHandlers {
  /// Throws std::invalid_argument for a wrong request.
  std::function<HttpOutcome(const HttpRequest&)> answer;
  /// Why a POST is refused, before its body is read; none: it is answered.
  std::function<std::optional<HttpAnswer>(const HttpRequest&)> refuse_change;
  /// Called on any thread.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// Answers GET, HEAD and POST over HTTP/1.0 and 1.1 on libmicrohttpd's thread. A request whose
/// answer is not ready waits without delaying others.
class HttpServer {
 public:
  /// Listens from now on. Throws std::runtime_error, naming the address, if it cannot.
  HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits,
             HttpHandlers handlers);
  /// Requests that wait get no answer.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// As http://127.0.0.1:7602, with the actual port.
  const std::string& url() const { return url_; }
  /// Calls all pending answers and streams again; those whose client has disconnected are
  /// destroyed. Ends connections whose time is up. From any thread; does not block.
  void wake();
  /// Number of answers by status. For the handlers.
  const std::map<unsigned, std::uint64_t>& answers() const { return answers_; }

 private:
  struct Exchange;
  struct Stream;
  using Time = std::chrono::steady_clock::time_point;
  struct Transfer {
    int socket;
    Time due;  ///< when the request, or the answer, must have come through
  };

  static MHD_Result on_request(void* self, MHD_Connection* connection, const char* path,
                               const char* method, const char* version, const char* upload,
                               std::size_t* upload_bytes, void** exchange);
  static void on_connection(void* self, MHD_Connection* connection, void** context,
                            MHD_ConnectionNotificationCode what);
  static ssize_t on_stream(void* stream, std::uint64_t position, char* into, std::size_t most);

  MHD_Result begin(MHD_Connection* connection, Exchange& exchange);
  MHD_Result answer(MHD_Connection* connection, Exchange& exchange);
  std::optional<HttpAnswer> poll(Exchange& exchange) const;
  MHD_Result send(MHD_Connection* connection, Exchange& exchange, HttpAnswer answer);
  MHD_Response* response_of(MHD_Connection* connection, HttpAnswer& answer);
  void suspend(MHD_Connection* connection, std::uint64_t wakes);
  /// When that many bytes must have been transferred, beginning now.
  Time due_for(std::size_t bytes) const;
  void set_due(MHD_Connection* connection, Time due);

  const OwnNames names_;
  const HttpLimits limits_;
  const HttpHandlers handlers_;
  std::string url_;
  std::map<unsigned, std::uint64_t> answers_;  // used by the server's thread only
  unsigned streams_ = 0;                       // the same
  std::atomic<bool> is_stopping_ = false;
  std::atomic<std::uint64_t> wakes_ = 0;
  std::mutex mutex_;
  std::set<MHD_Connection*> suspended_;            // guarded by mutex_
  std::map<MHD_Connection*, Transfer> transfers_;  // of all connections; the same
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace oblique::server
