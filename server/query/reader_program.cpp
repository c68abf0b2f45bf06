#include "server/query/reader_program.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <fstream>
#include <iostream>
#include <new>
#include <string_view>
#include <system_error>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "proto/frames.h"
#include "proto/text.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// Bytes of address space of this process now. Sanitizers reserve much more than the memory in use.
rlim_t mapped_bytes() {
  std::ifstream sizes("/proc/self/statm");
  rlim_t pages = 0;
  check_call(static_cast<bool>(sizes >> pages), "/proc/self/statm");
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

template <typename Resource>
void limit(Resource resource, rlim_t most) {
  const rlimit limits{most, most};
  check_call(setrlimit(resource, &limits) == 0, "setrlimit");
}

void confine() {
  constexpr std::int64_t kHeapBytes = 256 << 20U;  // for SQLite, which sorts and groups in memory
  constexpr rlim_t kOwnBytes = 512U << 20U;        // for the answer
  constexpr rlim_t kLargestFile = 64U << 20U;      // SQLite may create the log's index (-shm)
  constexpr int kNiceness = 5;  // a lower priority than that of server and workers
  check_call(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "prctl");
  // A write beyond the largest file becomes an error instead of a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  limit(RLIMIT_AS, mapped_bytes() + static_cast<rlim_t>(kHeapBytes) + kOwnBytes);
  limit(RLIMIT_FSIZE, kLargestFile);
  limit(RLIMIT_CORE, 0);
  sqlite3_hard_heap_limit64(kHeapBytes);
  // If the next two calls are not allowed, the reader runs without their effect. The kernel kills
  // this process first when memory runs out.
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
  std::ofstream("/proc/self/oom_score_adj") << "1000";
}

/// Whether the server no longer reads the answer, for example because it was killed.
bool server_is_gone() {
  pollfd answer{STDOUT_FILENO, 0, 0};
  return ::poll(&answer, 1, 0) > 0;
}

/// Blocks until the server has read the frame. A signal ends the process when the server is gone.
void send_frame(const std::string& reply, bool is_last) {
  const FrameHead head{static_cast<std::uint32_t>(reply.size()), is_last ? 1U : 0U};
  std::string frame(reinterpret_cast<const char*>(&head), sizeof head);
  frame += reply;
  for (std::string_view left = frame; !left.empty();) {
    const ssize_t sent = ::write(STDOUT_FILENO, left.data(), left.size());
    check_call(sent >= 0 || errno == EINTR, "write");
    left.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(sent, 0)));
  }
}

void send_answer(const std::string& path, const protocol::QueryRequest& request) {
  Reader reader(path);
  QueryLimits limits;
  limits.time_limit_ms = 0;  // the server kills this process at the deadline
  Answer answer = reader.answer(request, limits);
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = answer.next();
    ends = chunk.ends();
    send_frame(protocol::reply_around(protocol::encode(chunk)), ends);
  }
}

}  // namespace

void check_call(bool done, const char* what) {
  if (!done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

std::string encoded_error(const std::string& message, bool wrong_request) {
  constexpr std::size_t kLongestError = 4000;
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
    protocol::QueryRequest request;
    check_call(request.ParseFromFileDescriptor(kReaderRequest), "the query");
    try {
      send_answer(path, request);
    } catch (const std::bad_alloc&) {
      send_frame(encoded_error("the answer needs more memory than a query may have"), true);
    } catch (const std::exception& error) {
      const bool is_wrong = dynamic_cast<const StatementError*>(&error) != nullptr ||
                            dynamic_cast<const solver::InputError*>(&error) != nullptr;
      send_frame(encoded_error(error.what(), is_wrong), true);
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "oblique-server " << kReadMode << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace oblique::server
