// A library that a test loads into a program with LD_PRELOAD, so that the program needs no hooks.
// The library intercepts the calls with which the program commits, sends and receives. At one of
// these calls it sends a signal to the program.
//
// OBLIQUE_KILL_AT = "PROGRAM POINT OCCURRENCE SIGNAL PAUSE_MS MARK" defines the signal:
//   PROGRAM     name of the program; other programs inherit the variable and ignore it
//   POINT       before-commit, after-commit, before-send:KIND, after-send:KIND, after-receive:KIND,
//               or time; KIND is a kind of message in proto/oblique.proto
//   OCCURRENCE  n-th arrival at the point, from 1; for time: milliseconds after the start
//   SIGNAL      number of the signal
//   PAUSE_MS    sleep before the signal, for example until a message has been sent
//   MARK        file for the process id, written before the signal is sent. If the file exists,
//               another process already got the signal, and this process continues.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sqlite3.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zmq.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace {

struct Order {
  std::string point;
  int occurrence = 0;
  int signal = 0;
  int pause_ms = 0;
  std::string mark;
};

std::optional<Order> order_for(const std::string& program) {
  const char* text = std::getenv("OBLIQUE_KILL_AT");
  if (text == nullptr) {
    return std::nullopt;
  }
  std::istringstream words(text);
  std::string meant;
  Order order;
  words >> meant >> order.point >> order.occurrence >> order.signal >> order.pause_ms >> order.mark;
  return words && meant == program ? std::optional(order) : std::nullopt;
}

// ---- Kinds of messages --------------------------------------------------------------------------

/// Names of kinds of messages, in the order of their Protobuf field numbers, which begin at
/// `first`.
struct Kinds {
  std::uint64_t first;
  std::vector<std::string> names;
};

const Kinds& kinds_of(const std::string& program, bool sent, bool with_client) {
  static const Kinds to_server{1, {"hello", "credit", "results", "heartbeat", "goodbye"}};
  static const Kinds to_worker{
      1,
      {"welcome", "refused", "study", "batch", "results_stored", "withdraw", "hello_again",
       "heartbeat_reply", "stopping", "release", "notice"}};
  static const Kinds request{3, {"submit", "status", "workers", "change", "query"}};
  static const Kinds reply{2, {"error", "submit", "status", "workers", "change", "query"}};
  const bool by_server = (program == "oblique-server") == sent;
  if (with_client) {
    return by_server ? reply : request;
  }
  return by_server ? to_worker : to_server;
}

/// Removes a varint from the front of `bytes` and returns it.
std::uint64_t take_varint(std::basic_string_view<unsigned char>& bytes) {
  std::uint64_t value = 0;
  for (int shift = 0; !bytes.empty() && shift < 64; shift += 7) {
    const unsigned char byte = bytes.front();
    bytes.remove_prefix(1);
    value |= std::uint64_t{byte & 0x7fU} << shift;
    if (byte < 0x80) {
      break;
    }
  }
  return value;
}

/// Returns the kind of message in a frame; empty if unknown. Decodes by hand, because the Protobuf
/// library refuses a second copy of the generated code in one process.
std::string kind_of(const std::string& program, bool sent, const void* data, std::size_t size) {
  std::basic_string_view<unsigned char> bytes(static_cast<const unsigned char*>(data), size);
  constexpr unsigned char kNumberInFieldOne = 0x08;
  const bool with_client = !bytes.empty() && bytes.front() == kNumberInFieldOne;
  const Kinds& kinds = kinds_of(program, sent, with_client);
  // The kind is the first field that contains a message. Earlier fields contain only numbers.
  while (!bytes.empty()) {
    const std::uint64_t tag = take_varint(bytes);
    constexpr std::uint64_t kNumber = 0;
    constexpr std::uint64_t kMessage = 2;
    if ((tag & 7U) == kMessage) {
      const std::uint64_t index = (tag >> 3U) - kinds.first;
      return index < kinds.names.size() ? kinds.names[index] : std::string();
    }
    if ((tag & 7U) != kNumber) {
      break;
    }
    take_varint(bytes);
  }
  return {};
}

// ---- The points ---------------------------------------------------------------------------------

class KillPoints {
 public:
  KillPoints() : program_(program_invocation_short_name), order_(order_for(program_)) {
    if (order_ && order_->point == "time") {
      start_clock();
    }
  }

  bool armed() const { return order_.has_value(); }
  /// Only the server uses sockets directly, for ZMTP; the other programs use libzmq.
  bool watches_sockets() const { return armed() && program_ == "oblique-server"; }

  void reached(const std::string& point) {
    if (order_ && order_->point == point && ++times_ == order_->occurrence) {
      std::this_thread::sleep_for(std::chrono::milliseconds(order_->pause_ms));
      send_signal();
    }
  }

  void reached(const char* point, bool sent, const void* data, std::size_t size) {
    const std::string kind = kind_of(program_, sent, data, size);
    if (!kind.empty()) {
      reached(point + kind);
    }
  }

 private:
  void send_signal() const {
    const int mark = open(order_->mark.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
    if (mark < 0) {
      return;
    }
    const std::string line = std::to_string(getpid()) + "\n";
    const bool written = write(mark, line.data(), line.size()) > 0;
    close(mark);
    if (written) {
      kill(getpid(), order_->signal);
    }
  }

  /// Starts the timer thread. It blocks all signals, so that the program's own threads get them.
  void start_clock() const {
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    std::thread([this] {
      std::this_thread::sleep_for(std::chrono::milliseconds(order_->occurrence));
      send_signal();
    }).detach();
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  std::string program_;
  std::optional<Order> order_;
  std::atomic<int> times_ = 0;
};

/// Parses the bytes that one side of a ZMTP connection sends: a greeting, then frames.
class Stream {
 public:
  /// Adds bytes, and calls `take` with the body of every complete message.
  template <class Take>
  void receive(std::string_view bytes, const Take& take) {
    buffer_ += bytes;
    constexpr std::size_t kGreeting = 64;
    if (!greeted_ && buffer_.size() >= kGreeting) {
      greeted_ = true;
      buffer_.erase(0, kGreeting);
    }
    while (greeted_ && take_frame(take)) {
    }
  }

 private:
  template <class Take>
  bool take_frame(const Take& take) {
    constexpr unsigned kLong = 2;
    constexpr unsigned kCommand = 4;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(buffer_[i]); };
    const std::size_t header = buffer_.empty() || (byte(0) & kLong) == 0 ? 2 : 9;
    if (buffer_.size() < header) {
      return false;
    }
    std::uint64_t size = 0;
    for (std::size_t i = 1; i < header; ++i) {
      size = size << 8U | byte(i);
    }
    if (buffer_.size() - header < size) {
      return false;
    }
    if ((byte(0) & kCommand) == 0) {
      take(std::string_view(buffer_).substr(header, static_cast<std::size_t>(size)));
    }
    buffer_.erase(0, header + static_cast<std::size_t>(size));
    return true;
  }

  std::string buffer_;
  bool greeted_ = false;
};

struct Connection {
  Stream received;
  Stream sent;
};

/// Connections by descriptor. They need no lock, because one thread of the server uses all sockets.
std::map<int, Connection>& connections() {
  static auto* const only = new std::map<int, Connection>;
  return *only;
}

/// The object is never destroyed, because threads may use it until the process ends.
KillPoints& points() {
  static auto* const only = new KillPoints;
  return *only;
}

[[gnu::constructor]] void start() {
  points();
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// ---- Replacements of library functions ----------------------------------------------------------

extern "C" int sqlite3_exec(sqlite3* database, const char* sql,
                            int (*take)(void*, int, char**, char**), void* context,
                            char** message) {
  static auto* const real = next<decltype(sqlite3_exec)>("sqlite3_exec");
  const bool commits = points().armed() && sql != nullptr && std::string_view(sql) == "COMMIT";
  if (commits) {
    points().reached("before-commit");
  }
  const int code = real(database, sql, take, context, message);
  if (commits && code == SQLITE_OK) {
    points().reached("after-commit");
  }
  return code;
}

extern "C" int zmq_send(void* socket, const void* data, std::size_t size, int flags) {
  static auto* const real = next<decltype(zmq_send)>("zmq_send");
  const bool whole = points().armed() && (flags & ZMQ_SNDMORE) == 0;
  if (whole) {
    points().reached("before-send:", true, data, size);
  }
  const int sent = real(socket, data, size, flags);
  const int error = errno;
  if (whole && sent >= 0) {
    points().reached("after-send:", true, data, size);
  }
  errno = error;
  return sent;
}

extern "C" int zmq_msg_recv(zmq_msg_t* message, void* socket, int flags) {
  static auto* const real = next<decltype(zmq_msg_recv)>("zmq_msg_recv");
  const int received = real(message, socket, flags);
  const int error = errno;
  if (received >= 0 && points().armed() && zmq_msg_more(message) == 0) {
    points().reached("after-receive:", false, zmq_msg_data(message), zmq_msg_size(message));
  }
  errno = error;
  return received;
}

/// Returns true for TCP sockets, false for the Unix sockets to query processes.
static bool is_of_a_peer(int socket) {
  int domain = 0;
  socklen_t size = sizeof domain;
  return points().watches_sockets() &&
         getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 &&
         (domain == AF_INET || domain == AF_INET6);
}

extern "C" int accept4(int listener, sockaddr* address, socklen_t* size, int flags) {
  static auto* const real = next<decltype(accept4)>("accept4");
  const int accepted = real(listener, address, size, flags);
  const int error = errno;
  if (accepted >= 0 && points().watches_sockets()) {
    connections()[accepted] = {};
  }
  errno = error;
  return accepted;
}

extern "C" ssize_t send(int socket, const void* bytes, std::size_t size, int flags) {
  static auto* const real = next<decltype(send)>("send");
  const bool is_watched = is_of_a_peer(socket);
  if (is_watched) {
    Stream to_send = connections()[socket].sent;
    to_send.receive({static_cast<const char*>(bytes), size}, [](std::string_view body) {
      points().reached("before-send:", true, body.data(), body.size());
    });
  }
  const ssize_t sent = real(socket, bytes, size, flags);
  const int error = errno;
  if (is_watched && sent > 0) {
    connections()[socket].sent.receive(
        {static_cast<const char*>(bytes), static_cast<std::size_t>(sent)},
        [](std::string_view body) {
          points().reached("after-send:", true, body.data(), body.size());
        });
  }
  errno = error;
  return sent;
}

extern "C" ssize_t recv(int socket, void* bytes, std::size_t size, int flags) {
  static auto* const real = next<decltype(recv)>("recv");
  const ssize_t received = real(socket, bytes, size, flags);
  const int error = errno;
  if (received > 0 && is_of_a_peer(socket)) {
    connections()[socket].received.receive(
        {static_cast<const char*>(bytes), static_cast<std::size_t>(received)},
        [](std::string_view body) {
          points().reached("after-receive:", false, body.data(), body.size());
        });
  }
  errno = error;
  return received;
}
