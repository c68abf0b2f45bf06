#include "server/queries/reader_program.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>

#include <malloc.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include <csignal>

#include "proto/frames.h"
#include "proto/text.h"
#include "server/reading/query_values.h"
#include "server/reading/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// Memory beside SQLite's: the answer and what holds it while it is made.
constexpr rlim_t kOwnBytes = 512U << 20U;
/// SQLite may make the database's index of the write-ahead log, and writes nothing else.
constexpr rlim_t kLargestFile = 64U << 20U;
/// Behind the server and the workers, and the first to go when the machine runs out of memory.
constexpr int kNiceness = 5;
constexpr const char* kFirstToGo = "1000";
/// Processor time over a query's limit: a backstop, for the server ends it before.
constexpr rlim_t kSpareCpu_s = 10;
constexpr std::size_t kLongestError = 4000;

void check(bool done, const char* what) {
  if (!done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

/// Bytes of address space that this process has now. More than memory: sanitizers reserve much.
rlim_t mapped_bytes() {
  std::ifstream sizes("/proc/self/statm");
  rlim_t pages = 0;
  check(static_cast<bool>(sizes >> pages), "/proc/self/statm");
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

template <typename Resource>
void limit(Resource resource, rlim_t most) {
  const rlimit limits{most, most};
  check(setrlimit(resource, &limits) == 0, "setrlimit");
}

/// Whether the server has closed its end, which a server that was killed has.
bool server_is_gone() {
  pollfd channel{kReaderChannel, 0, 0};
  return ::poll(&channel, 1, 0) > 0 && (channel.revents & POLLHUP) != 0;
}

void confine() {
  check(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "prctl");
  // Writing where nothing may be written is an error, no reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  limit(RLIMIT_AS, mapped_bytes() + static_cast<rlim_t>(kReaderHeapBytes) + kOwnBytes);
  limit(RLIMIT_FSIZE, kLargestFile);
  limit(RLIMIT_CORE, 0);
  sqlite3_hard_heap_limit64(kReaderHeapBytes);
  // The next two help the rest of the machine; where they are not allowed it goes without.
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
  std::ofstream("/proc/self/oom_score_adj") << kFirstToGo;
}

/// SIGXCPU ends the process when this query takes so much more than it may.
void limit_cpu(std::int64_t time_limit_ms) {
  rusage used{};
  check(getrusage(RUSAGE_SELF, &used) == 0, "getrusage");
  const auto used_s = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const rlimit limits{used_s + static_cast<rlim_t>(time_limit_ms / 1000) + kSpareCpu_s,
                      RLIM_INFINITY};
  check(setrlimit(RLIMIT_CPU, &limits) == 0, "setrlimit");
}

/// False when the channel was closed before all bytes came.
bool receive_all(void* to, std::size_t size) {
  auto* at = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t got = ::read(kReaderChannel, at, size);
    if (got > 0) {
      at += got;
      size -= static_cast<std::size_t>(got);
    } else if (got == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

/// Waits until the server takes more; calls `stalls` when that is not before long.
void wait_for_server(const std::function<void()>& stalls) {
  constexpr int kSoon_ms = 100;
  pollfd channel{kReaderChannel, POLLOUT, 0};
  if (::poll(&channel, 1, kSoon_ms) == 0) {
    stalls();
    (void)::poll(&channel, 1, -1);
  }
}

/// False when the server has gone.
bool send_all(const void* from, std::size_t size, const std::function<void()>& stalls) {
  const auto* at = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t sent = ::send(kReaderChannel, at, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      at += sent;
      size -= static_cast<std::size_t>(sent);
    } else if (errno == EAGAIN) {
      wait_for_server(stalls);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

std::optional<protocol::QueryRequest> next_request() {
  FrameLength length = 0;
  if (!receive_all(&length, sizeof length) || length > protocol::kMaxFrameBytes) {
    return std::nullopt;
  }
  std::string frame(length, '\0');
  protocol::QueryRequest request;
  if (!receive_all(frame.data(), frame.size()) || !protocol::decode(frame, request)) {
    return std::nullopt;
  }
  return request;
}

/// False when the server has gone.
bool send_answer(
    AnswerHead head, const std::string& reply, const std::function<void()>& stalls = [] {}) {
  head.length = static_cast<std::uint32_t>(reply.size());
  return send_all(&head, sizeof head, stalls) && send_all(reply.data(), reply.size(), stalls);
}

constexpr AnswerHead kLast{
    .length = 0, .ends = 1, .can_go_on = 0, .reserved = 0, .last_point = 0, .rows = 0, .chunks = 0};

/// Gives chunk by chunk what the server takes; waits for it in between, in which the processor's
/// time and the query's stand still. False when the server has gone.
bool send_chunks(Reader& reader, const protocol::QueryRequest& request, const QueryLimits& limits) {
  Answer answer = reader.answer(request, limits);
  while (true) {
    limit_cpu(limits.time_limit_ms);
    const protocol::QueryReply chunk = answer.next();
    const protocol::GivenRows& given = answer.given();
    const AnswerHead head{.length = 0,
                          .ends = static_cast<std::uint8_t>(chunk.ends() ? 1 : 0),
                          .can_go_on = static_cast<std::uint8_t>(answer.can_go_on() ? 1 : 0),
                          .reserved = 0,
                          .last_point = given.last_point(),
                          .rows = given.rows(),
                          .chunks = given.chunks()};
    const auto rest = [&answer] {
      if (answer.can_go_on()) {
        answer.rest();
      }
    };
    if (!send_answer(head, protocol::reply_around(protocol::encode(chunk)), rest)) {
      return false;
    }
    if (chunk.ends()) {
      return true;
    }
  }
}

/// False when the server has gone.
bool answer(std::optional<Reader>& reader, const std::string& path,
            const protocol::QueryRequest& request) {
  const QueryLimits limits = limits_of(request);
  std::string reply;
  try {
    limit_cpu(limits.time_limit_ms);
    if (!reader) {
      reader.emplace(path);
    }
    if (request.in_chunks() || request.has_question()) {
      return send_chunks(*reader, request, limits);
    }
    reply = protocol::reply_around(reader->encoded_query(request.sql(), limits));
  } catch (const std::bad_alloc&) {
    reply = encoded_error("the answer needs more memory than a query may have");
  } catch (const StatementError& error) {
    reply = encoded_error(error.what(), true);
  } catch (const solver::InputError& error) {
    reply = encoded_error(error.what(), true);
  } catch (const std::exception& error) {
    reply = encoded_error(error.what());
  }
  return send_answer(kLast, reply);
}

}  // namespace

std::string encoded_error(const std::string& message, bool wrong_request) {
  protocol::ClientReply reply;
  reply.mutable_error()->set_wrong_request(wrong_request);
  // A statement may have put any bytes into what SQLite says.
  reply.mutable_error()->set_message(protocol::shortened(
      protocol::is_utf8(message) ? message : hexadecimal(message), kLongestError));
  return protocol::encode(reply);
}

int run_reader_program(const std::string& path) {
  try {
    protocol::silence_protobuf();
    confine();
    // A server that was killed before confine sends no signal, and its query would run for nobody.
    if (server_is_gone()) {
      return 0;
    }
    std::optional<Reader> reader;
    while (const auto request = next_request()) {
      if (!answer(reader, path, *request)) {
        return 1;
      }
      malloc_trim(0);  // what one query had is not kept for the next
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "oblique-server " << kReadMode << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace oblique::server
