#include "server/query/reader_process.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "proto/frames.h"
#include "proto/system/descriptor.h"
#include "proto/system/spawn_plan.h"
#include "proto/text.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

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

void confine() {
  constexpr rlim_t kOwnBytes = 512U << 20U;    // for the answer, in addition to SQLite's memory
  constexpr rlim_t kLargestFile = 64U << 20U;  // SQLite may create the log's index (-shm)
  constexpr int kNiceness = 5;                 // a lower priority than that of server and workers
  check(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "prctl");
  // A write beyond the largest file becomes an error instead of a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  limit(RLIMIT_AS, mapped_bytes() + static_cast<rlim_t>(kReaderHeapBytes) + kOwnBytes);
  limit(RLIMIT_FSIZE, kLargestFile);
  limit(RLIMIT_CORE, 0);
  sqlite3_hard_heap_limit64(kReaderHeapBytes);
  // If the next two calls are not allowed, the reader runs without their effect. The kernel kills
  // this process first when memory runs out.
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
  std::ofstream("/proc/self/oom_score_adj") << "1000";
}

/// Whether the server has closed its end of the channel, as it also does when it is killed.
bool server_is_gone() {
  pollfd channel{kReaderChannel, 0, 0};
  return ::poll(&channel, 1, 0) > 0 && (channel.revents & POLLHUP) != 0;
}

/// False when the channel was closed before all bytes were received.
bool receive_all(void* to, std::size_t size) {
  ssize_t got = -1;
  do {
    got = ::recv(kReaderChannel, to, size, MSG_WAITALL);
  } while (got < 0 && errno == EINTR);
  return got == static_cast<ssize_t>(size);
}

/// Blocks until the server has received all bytes. False when the server has ended.
bool send_all(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(kReaderChannel, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) {
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(sent, 0)));
  }
  return true;
}

std::string framed(const std::string& message, bool is_last) {
  const FrameHead head{static_cast<std::uint32_t>(message.size()), is_last ? 1U : 0U};
  return std::string(reinterpret_cast<const char*>(&head), sizeof head) + message;
}

/// The next query; none when the server has ended.
std::optional<protocol::QueryRequest> next_request() {
  FrameHead head{};
  if (!receive_all(&head, sizeof head) || head.length > protocol::kMaxFrameBytes) {
    return std::nullopt;
  }
  std::string frame(head.length, '\0');
  protocol::QueryRequest request;
  const bool is_whole = (frame.empty() || receive_all(frame.data(), frame.size())) &&
                        protocol::decode(frame, request);
  return is_whole ? std::optional(std::move(request)) : std::nullopt;
}

/// Sends the answer chunk by chunk. False when the server has ended.
bool send_answer(std::optional<Reader>& reader, const std::string& path,
                 const protocol::QueryRequest& request) {
  std::string error;
  try {
    if (!reader) {
      reader.emplace(path);
    }
    // No time limit, because the server kills this process at the deadline.
    QueryLimits limits;
    limits.time_limit_ms = 0;
    Answer answer = reader->answer(request, limits);
    for (bool ends = false; !ends;) {
      const protocol::QueryReply chunk = answer.next();
      ends = chunk.ends();
      if (!send_all(framed(protocol::reply_around(protocol::encode(chunk)), ends))) {
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
  return send_all(framed(error, true));
}

}  // namespace

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

ReaderProcess::ReaderProcess(const std::string& program, const std::string& path) {
  std::array<int, 2> ends{};
  check(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0, "socketpair");
  protocol::Descriptor ours(ends[0]);
  const protocol::Descriptor theirs(ends[1]);
  check(fcntl(ours.number(), F_SETFL, O_NONBLOCK) == 0, "fcntl");
  protocol::SpawnPlan plan;
  plan.give(theirs.number(), kReaderChannel);
  plan.give(STDERR_FILENO, STDOUT_FILENO);
  plan.close_from(kReaderChannel + 1);
  pid_ = plan.start(program, {"oblique-reader", kReadMode, path}, environ);
  channel_ = ours.release();
}

ReaderProcess::~ReaderProcess() {
  kill();
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  ::close(channel_);
}

void ReaderProcess::kill() {
  // Only the destructor waits for the process, so its id cannot have been reused.
  ::kill(pid_, SIGKILL);
}

void ReaderProcess::ask(const std::string& request) {
  out_ = framed(request, true);
}

short ReaderProcess::events() const {
  return static_cast<short>(out_.empty() ? POLLIN : POLLIN | POLLOUT);
}

std::optional<ReaderProcess::Frame> ReaderProcess::read() {
  while (!out_.empty()) {
    const ssize_t sent = ::send(channel_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) {
      is_broken_ = is_broken_ || errno != EAGAIN;
      break;
    }
    out_.erase(0, static_cast<std::size_t>(std::max<ssize_t>(sent, 0)));
  }
  while (!is_broken_) {
    FrameHead head{};
    if (in_.size() >= sizeof head) {
      std::memcpy(&head, in_.data(), sizeof head);
      if (in_.size() >= sizeof head + head.length) {
        Frame frame{in_.substr(sizeof head, head.length), head.is_last != 0};
        in_.erase(0, sizeof head + head.length);
        return frame;
      }
    }
    is_broken_ = head.length > protocol::kMaxFrameBytes;
    if (is_broken_ || !receive_some()) {
      break;
    }
  }
  return std::nullopt;
}

/// False when nothing was received.
bool ReaderProcess::receive_some() {
  constexpr std::size_t kReadBytes = 64 * 1024;
  std::array<char, kReadBytes> bytes;
  const ssize_t got = ::recv(channel_, bytes.data(), bytes.size(), 0);
  if (got > 0) {
    in_.append(bytes.data(), static_cast<std::size_t>(got));
  }
  is_broken_ = got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
  return got > 0;
}

}  // namespace oblique::server
