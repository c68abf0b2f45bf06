#include "server/query/reader_program.h"

#include <cerrno>
#include <exception>
#include <fstream>
#include <iostream>
#include <new>
#include <optional>
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
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// Memory for the answer, in addition to SQLite's.
constexpr rlim_t kOwnBytes = 512U << 20U;
/// SQLite may create the index of the write-ahead log (-shm), and writes nothing else.
constexpr rlim_t kLargestFile = 64U << 20U;
/// A lower priority than that of server and workers. When memory runs out, the kernel kills this
/// process first.
constexpr int kNiceness = 5;
constexpr const char* kFirstToGo = "1000";
/// Processor time beyond the limit of a query. Matters only if the server, which would kill this
/// process, has ended.
constexpr rlim_t kSpareCpu_s = 10;
constexpr std::size_t kLongestError = 4000;

void check(bool done, const char* what) {
  if (!done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

/// Bytes of address space of this process now. Sanitizers reserve much more than the memory in use.
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

/// Whether the server has closed its end of the channel, as it also does when it is killed.
bool server_is_gone() {
  pollfd channel{kReaderChannel, 0, 0};
  return ::poll(&channel, 1, 0) > 0 && (channel.revents & POLLHUP) != 0;
}

void confine() {
  check(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "prctl");
  // A write beyond the largest file becomes an error instead of a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  limit(RLIMIT_AS, mapped_bytes() + static_cast<rlim_t>(kReaderHeapBytes) + kOwnBytes);
  limit(RLIMIT_FSIZE, kLargestFile);
  limit(RLIMIT_CORE, 0);
  sqlite3_hard_heap_limit64(kReaderHeapBytes);
  // If the next two calls are not allowed, the reader runs without their effect.
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
  std::ofstream("/proc/self/oom_score_adj") << kFirstToGo;
}

/// Makes SIGXCPU end the process when one chunk takes far longer than the query's limit.
void limit_cpu(std::int64_t time_limit_ms) {
  rusage used{};
  check(getrusage(RUSAGE_SELF, &used) == 0, "getrusage");
  const auto used_s = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const rlimit limits{used_s + static_cast<rlim_t>(time_limit_ms / 1000) + kSpareCpu_s,
                      RLIM_INFINITY};
  check(setrlimit(RLIMIT_CPU, &limits) == 0, "setrlimit");
}

/// False when the channel was closed before all bytes were received.
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

/// Blocks until the server has received all bytes. False when the server has ended.
bool send_all(const void* from, std::size_t size) {
  const auto* at = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t sent = ::send(kReaderChannel, at, size, MSG_NOSIGNAL);
    if (sent >= 0) {
      at += sent;
      size -= static_cast<std::size_t>(sent);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

bool send_frame(const std::string& reply, bool is_last) {
  const FrameHead head{static_cast<std::uint32_t>(reply.size()), is_last ? 1U : 0U};
  return send_all(&head, sizeof head) && send_all(reply.data(), reply.size());
}

/// The next query; empty when the server has ended.
std::optional<protocol::QueryRequest> next_request() {
  FrameHead head{};
  if (!receive_all(&head, sizeof head) || head.length > protocol::kMaxFrameBytes) {
    return std::nullopt;
  }
  std::string frame(head.length, '\0');
  protocol::QueryRequest request;
  if (!receive_all(frame.data(), frame.size()) || !protocol::decode(frame, request)) {
    return std::nullopt;
  }
  return request;
}

/// Sends the answer chunk by chunk. False when the server has ended.
bool send_answer(std::optional<Reader>& reader, const std::string& path,
                 const protocol::QueryRequest& request) {
  const std::int64_t time_limit_ms = time_limit_of(request);
  std::string error;
  try {
    limit_cpu(time_limit_ms);
    if (!reader) {
      reader.emplace(path);
    }
    // No time limit, because the server kills this process at the deadline.
    QueryLimits limits;
    limits.time_limit_ms = 0;
    Answer answer = reader->answer(request, limits);
    for (bool ends = false; !ends;) {
      limit_cpu(time_limit_ms);
      const protocol::QueryReply chunk = answer.next();
      ends = chunk.ends();
      if (!send_frame(protocol::reply_around(protocol::encode(chunk)), ends)) {
        return false;
      }
    }
    return true;
  } catch (const std::bad_alloc&) {
    error = encoded_error("the answer needs more memory than a query may have");
  } catch (const StatementError& wrong) {
    error = encoded_error(wrong.what(), true);
  } catch (const solver::InputError& wrong) {
    error = encoded_error(wrong.what(), true);
  } catch (const std::exception& failure) {
    error = encoded_error(failure.what());
  }
  return send_frame(error, true);
}

}  // namespace

std::string encoded_error(const std::string& message, bool wrong_request) {
  protocol::ClientReply reply;
  reply.mutable_error()->set_wrong_request(wrong_request);
  // SQLite's message may contain any bytes of the statement.
  reply.mutable_error()->set_message(protocol::shortened(
      protocol::is_utf8(message) ? message : hexadecimal(message), kLongestError));
  return protocol::encode(reply);
}

int run_reader_program(const std::string& path) {
  try {
    protocol::silence_protobuf();
    confine();
    // A server that was killed before the call of `confine` causes no signal to this process.
    if (server_is_gone()) {
      return 0;
    }
    std::optional<Reader> reader;
    while (const auto request = next_request()) {
      if (!send_answer(reader, path, *request)) {
        return 1;
      }
      malloc_trim(0);  // returns the memory of one query before the next
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "oblique-server " << kReadMode << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace oblique::server
