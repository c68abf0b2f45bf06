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

/// Limits on resources that HTTP peers can use. Each connection serves one request.
struct HttpLimits {
  unsigned connections = 256;  ///< the last one ends an older transfer, so that one is free
  unsigned streams = 32;
  /// Memory of a connection for the request line, its headers and the headers of the answer.
  std::size_t bytes_of_connection = std::size_t{16} * 1024;
  /// A connection is closed after this time without any transfer, except while the server prepares
  /// its answer. The head of a request must arrive within this time after connecting.
  std::chrono::seconds idle{10};
  /// The transfer of a request or answer, except a stream, may take `idle` plus one second per this
  /// number of bytes.
  std::size_t least_bytes_a_second = std::size_t{4} * 1024;
};

/// Functions that the server calls. All except `now` are called on its thread.
struct HttpHandlers {
  /// Answers a request. Throws std::invalid_argument for a wrong request.
  std::function<HttpOutcome(const HttpRequest&)> answer;
  /// Returns the answer that refuses a POST before its body is read; nothing if it is accepted.
  std::function<std::optional<HttpAnswer>(const HttpRequest&)> refuse_change;
  /// May be called on any thread.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// Answers GET, HEAD and POST over HTTP/1.0 and 1.1 on libmicrohttpd's thread. A request that waits
/// for its answer does not delay others.
class HttpServer {
 public:
  /// Starts to listen. Throws std::runtime_error, which names the address, if it cannot.
  HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits,
             HttpHandlers handlers);
  /// Ends the server. Waiting requests get no answer.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Returns an address with the actual port, such as http://127.0.0.1:7602.
  const std::string& url() const { return url_; }
  /// Polls all pending answers and streams again, destroys those of disconnected clients, and ends
  /// connections that exceed their time. Thread-safe; does not block.
  void wake();
  /// Returns the number of answers by status. Only handlers may call it.
  const std::map<unsigned, std::uint64_t>& answers() const { return answers_; }

 private:
  struct Exchange;
  struct Stream;
  using Time = std::chrono::steady_clock::time_point;
  struct Transfer {
    int socket;
    Time due;  ///< deadline for the request or the answer
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
  /// Returns the deadline for a transfer of this number of bytes that starts now.
  Time due_for(std::size_t bytes) const;
  void set_due(MHD_Connection* connection, Time due);

  const OwnNames names_;
  const HttpLimits limits_;
  const HttpHandlers handlers_;
  std::string url_;
  std::map<unsigned, std::uint64_t> answers_;  // used only by the server's thread
  unsigned streams_ = 0;                       // used only by the server's thread
  std::atomic<bool> is_stopping_ = false;
  std::atomic<std::uint64_t> wakes_ = 0;
  std::mutex mutex_;
  std::set<MHD_Connection*> suspended_;            // guarded by mutex_
  std::map<MHD_Connection*, Transfer> transfers_;  // for all connections; guarded by mutex_
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace oblique::server
