#include "server/query/query_pool.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "proto/frames.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

constexpr std::chrono::milliseconds kRetryPause{20};
constexpr std::int64_t kLongestWait_ms = 60'000;
/// For a cancelled query, this value replaces the number of received chunks.
constexpr std::uint64_t kCancelled = UINT64_MAX;

// ---- The reader process -------------------------------------------------------------------------

/// Returns the size of this process's address space [bytes]. Sanitizers reserve much more than they
/// use.
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
  constexpr rlim_t kOwnBytes = 512U << 20U;  // for the rest of the process, such as the answer
  // SQLite may create the log's index (-shm), which is smaller than this.
  constexpr rlim_t kLargestFile = 64U << 20U;
  constexpr int kNiceness = 5;  // lower priority than the server and the workers
  check_call(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "prctl");
  limit(RLIMIT_AS, mapped_bytes() + static_cast<rlim_t>(kHeapBytes) + kOwnBytes);
  limit(RLIMIT_FSIZE, kLargestFile);
  limit(RLIMIT_CORE, 0);
  sqlite3_hard_heap_limit64(kHeapBytes);
  // Errors of the next two calls are ignored, because the reader can run without them. With the
  // second one the kernel kills this process first when memory runs out.
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
  std::ofstream("/proc/self/oom_score_adj") << "1000";
}

/// Returns whether the server no longer reads the answer, for example because it was killed.
bool server_is_gone() {
  pollfd answer{STDOUT_FILENO, 0, 0};
  return ::poll(&answer, 1, 0) > 0;
}

/// Sends a frame and blocks until the server has read it. Ends the process if the server is gone.
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
  limits.time_limit_ms = 0;  // the server enforces the time limit
  Answer answer = reader.answer(request, limits);
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = answer.next();
    ends = chunk.ends();
    send_frame(
        protocol::encode_around(protocol::ClientReply(), protocol::ClientReply::kQueryFieldNumber,
                                protocol::encode(chunk)),
        ends);
  }
}

}  // namespace

void check_call(bool done, const char* what) {
  if (!done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

std::string encoded_error(const std::string& message, protocol::ErrorCode code) {
  constexpr std::size_t kLongestError = 4000;
  protocol::ClientReply reply;
  reply.mutable_error()->set_code(code);
  // SQLite's message may quote bytes of the statement that are not UTF-8.
  reply.mutable_error()->set_message(protocol::shortened(
      protocol::is_utf8(message) ? message : hexadecimal(message), kLongestError));
  return protocol::encode(reply);
}

int run_reader_program(const std::string& path) {
  try {
    protocol::silence_protobuf();
    confine();
    // If the server ended before `confine`, the kernel sends no signal about that.
    if (server_is_gone()) {
      return 0;
    }
    protocol::QueryRequest request;
    check_call(request.ParseFromFileDescriptor(kReaderRequest), "the query");
    try {
      send_answer(path, request);
    } catch (const std::bad_alloc&) {
      send_frame(encoded_error("the query needs more memory than is allowed"), true);
    } catch (const NoSuchStudy& error) {
      send_frame(encoded_error(error.what(), protocol::ERROR_CODE_NO_SUCH_STUDY), true);
    } catch (const std::exception& error) {
      const bool is_wrong = dynamic_cast<const StatementError*>(&error) != nullptr ||
                            dynamic_cast<const solver::InputError*>(&error) != nullptr;
      send_frame(encoded_error(error.what(), is_wrong ? protocol::ERROR_CODE_WRONG_REQUEST
                                                      : protocol::ERROR_CODE_FAILED),
                 true);
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "oblique-server " << kReadMode << ": " << error.what() << '\n';
    return 1;
  }
}

// ---- The queue ----------------------------------------------------------------------------------

bool QueryQueue::add(QueryJob job) {
  const auto of_client = std::ranges::count(waiting_, job.client, &QueryJob::client);
  std::size_t bytes = job.bytes = job.request.SpaceUsedLong();
  for (const QueryJob& other : waiting_) {
    bytes += other.bytes;
  }
  if (waiting_.size() >= settings_.most_waiting || bytes > settings_.most_waiting_bytes ||
      static_cast<std::size_t>(of_client) >= settings_.most_waiting_each) {
    return false;
  }
  waiting_.push_back(std::move(job));
  return true;
}

std::optional<QueryJob> QueryQueue::start_next() {
  const auto next = std::ranges::find_if(waiting_, [this](const QueryJob& job) {
    const auto running = std::ranges::count(running_, job.client, &Running::value_type::second);
    return static_cast<std::size_t>(running) < settings_.most_running_each;
  });
  if (running_.size() >= settings_.readers || next == waiting_.end()) {
    return std::nullopt;
  }
  QueryJob job = std::move(*next);
  waiting_.erase(next);
  running_.emplace(job.ticket, job.client);
  // Moves this client's other queries behind the queries of all other clients.
  std::stable_partition(waiting_.begin(), waiting_.end(),
                        [&](const QueryJob& each) { return each.client != job.client; });
  return job;
}

void QueryQueue::remove(std::uint64_t ticket) {
  running_.erase(ticket);
  std::erase_if(waiting_, [&](const QueryJob& job) { return job.ticket == ticket; });
}

// ---- The pool -----------------------------------------------------------------------------------

pid_t start_reader(const std::string& program, const std::string& path, int request, int answer) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, answer, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, request, kReaderRequest);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&actions, kReaderRequest + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&attributes, &signals);
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&attributes, &signals);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::array<std::string, 3> words{"oblique-reader", kReadMode, path};
  std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t pid = -1;
  const int error =
      posix_spawn(&pid, program.c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), program);
  }
  return pid;
}

/// A running query and its process. The process is killed when this object is destroyed, and when
/// the thread that created it ends.
struct QueryPool::Running {
  Running(const std::string& program, const std::string& path, const QueryJob& job)
      : ticket(job.ticket), time_limit_ms(time_limit_of(job.request)) {
    const protocol::Descriptor request(memfd_create("query", MFD_CLOEXEC));
    check_call(request.is_open() && job.request.SerializeToFileDescriptor(request.number()) &&
                   lseek(request.number(), 0, SEEK_SET) == 0,
               "memfd_create");
    std::array<int, 2> ends{};
    check_call(pipe2(ends.data(), O_CLOEXEC) == 0, "pipe2");
    answer = protocol::Descriptor(ends[0]);
    const protocol::Descriptor theirs(ends[1]);
    check_call(fcntl(answer.number(), F_SETFL, O_NONBLOCK) == 0, "fcntl");
    pid = start_reader(program, path, request.number(), theirs.number());
  }
  ~Running() {
    kill();
    while (waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void kill() const { ::kill(pid, SIGKILL); }
  bool waits_for_client() const { return given >= received_chunks + kChunksAhead; }

  struct Frame {
    std::string reply;
    bool is_last;
  };
  /// Returns the next frame if it is complete. The process blocks while its frames are not read.
  std::optional<Frame> next_frame() {
    constexpr std::size_t kReadBytes = 64 * 1024;
    std::array<char, kReadBytes> bytes;
    while (true) {
      FrameHead head{};
      std::memcpy(&head, received.data(), std::min(received.size(), sizeof head));
      if (received.size() >= sizeof head + head.length) {
        Frame frame{received.substr(sizeof head, head.length), head.is_last != 0};
        received.erase(0, sizeof head + head.length);
        return frame;
      }
      const ssize_t got = ::read(answer.number(), bytes.data(), bytes.size());
      is_broken = got == 0 || head.length > protocol::kMaxFrameBytes ||
                  (got < 0 && errno != EAGAIN && errno != EINTR);
      if (got <= 0 || is_broken) {
        return std::nullopt;
      }
      received.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }

  std::uint64_t ticket;
  std::int64_t time_limit_ms;
  /// deadline for the next chunk from the process or, while the query waits for the client, for the
  /// client to receive one
  std::int64_t deadline_ms = 0;
  std::int64_t answer_ends_ms = 0;    ///< deadline for the whole answer
  std::uint64_t given = 0;            ///< number of reported chunks
  std::uint64_t received_chunks = 0;  ///< number of chunks that the client has received
  pid_t pid = -1;
  protocol::Descriptor answer;
  std::string received;    ///< bytes of incomplete frames
  bool is_broken = false;  ///< true if the process has ended or sent a frame that is too long
};

QueryPool::QueryPool(std::string database, QueryPoolSettings settings, Report report)
    : database_(std::move(database)),
      settings_(std::move(settings)),
      report_(std::move(report)),
      queue_(settings_.queue),
      thread_([this] { run(); }) {}

QueryPool::~QueryPool() {
  stop();
}

bool QueryPool::submit(QueryJob job) {
  const std::lock_guard lock(mutex_);
  if (stopping_ || !queue_.add(std::move(job))) {
    return false;
  }
  woken_.wake();
  return true;
}

void QueryPool::more(std::uint64_t ticket, std::uint64_t received_chunks) {
  const std::lock_guard lock(mutex_);
  std::uint64_t& known = received_chunks_[ticket];
  known = std::max(known, received_chunks);
  woken_.wake();
}

void QueryPool::cancel(std::uint64_t ticket) {
  more(ticket, kCancelled);
}

void QueryPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    woken_.wake();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
}

void QueryPool::run() {
  const auto is_stopping = [this] {
    const std::lock_guard lock(mutex_);
    return stopping_;
  };
  while (!is_stopping()) {
    try {
      take_requests();
      std::erase_if(running_, [this](Running& query) { return !goes_on(query); });
      while (start_next()) {
      }
      wait();
    } catch (const std::exception&) {
      // After an exception such as std::bad_alloc, the loop pauses and continues.
      std::this_thread::sleep_for(kRetryPause);
    }
  }
  std::ranges::for_each(running_, &Running::kill);
  running_.clear();
}

/// Waits for output of a process, a call from another thread, or a deadline.
void QueryPool::wait() {
  std::vector<pollfd> items{{woken_.descriptor(), POLLIN, 0}};
  const std::int64_t now_ms = settings_.now_ms();
  std::int64_t until_ms = now_ms + kLongestWait_ms;
  for (const Running& query : running_) {
    if (!query.waits_for_client()) {
      items.push_back({query.answer.number(), POLLIN, 0});
    }
    until_ms = std::min({until_ms, query.deadline_ms, query.answer_ends_ms});
  }
  const std::int64_t left_ms = std::max<std::int64_t>(until_ms - now_ms, 0);
  (void)::poll(items.data(), items.size(), static_cast<int>(left_ms));
  woken_.clear();
}

void QueryPool::take_requests() {
  std::map<std::uint64_t, std::uint64_t> received_chunks;
  {
    const std::lock_guard lock(mutex_);
    received_chunks = std::exchange(received_chunks_, {});
  }
  for (const auto& request : received_chunks) {
    const auto query = std::ranges::find(running_, request.first, &Running::ticket);
    if (request.second == kCancelled) {
      forget(request.first);
      std::erase_if(running_, [&](const Running& each) { return each.ticket == request.first; });
    } else if (query != running_.end() && request.second > query->received_chunks) {
      const bool waited = query->waits_for_client();
      query->received_chunks = request.second;
      query->deadline_ms = waited ? settings_.now_ms() + query->time_limit_ms : query->deadline_ms;
    }
  }
}

bool QueryPool::start_next() {
  std::optional<QueryJob> job;
  {
    const std::lock_guard lock(mutex_);
    job = queue_.start_next();
  }
  if (!job) {
    return false;
  }
  try {
    Running& query = running_.emplace_back(settings_.reader_program, database_, *job);
    query.deadline_ms = settings_.now_ms() + query.time_limit_ms;
    query.answer_ends_ms = settings_.now_ms() + settings_.longest_answer_ms;
    report_({QueryReport::Kind::kBegun, job->ticket, {}});
  } catch (const std::exception& error) {
    std::erase_if(running_, [&](const Running& query) { return query.ticket == job->ticket; });
    end(job->ticket,
        encoded_error(std::string("cannot start a process for the query: ") + error.what()));
  }
  return true;
}

/// Reports frames that the process has sent, at most kChunksAhead more than the client has
/// received. Returns false if the query has ended.
bool QueryPool::goes_on(Running& query) {
  while (!query.waits_for_client()) {
    auto frame = query.next_frame();
    if (query.is_broken) {
      end(query.ticket,
          encoded_error(
              "the process of the query ended unexpectedly: it may have needed more memory "
              "than is available"));
      return false;
    }
    if (!frame) {
      break;
    }
    if (frame->is_last) {
      end(query.ticket, std::move(frame->reply));
      return false;
    }
    ++query.given;
    query.deadline_ms = settings_.now_ms() +
                        (query.waits_for_client() ? settings_.patience_ms : query.time_limit_ms);
    report_({QueryReport::Kind::kRows, query.ticket, std::move(frame->reply)});
  }
  const std::string error = missed_deadline(query);
  if (!error.empty()) {
    end(query.ticket, encoded_error(error));
  }
  return error.empty();
}

std::string QueryPool::missed_deadline(const Running& query) const {
  const std::int64_t now_ms = settings_.now_ms();
  if (now_ms >= query.answer_ends_ms) {
    return "the whole answer took more than " + std::to_string(settings_.longest_answer_ms / 1000) +
           " s: select less, for example with WHERE or LIMIT, or read the file with --db";
  }
  if (now_ms < query.deadline_ms) {
    return {};
  }
  return query.waits_for_client() ? "the answer is incomplete: the client read no rows for " +
                                        std::to_string(settings_.patience_ms / 1000) +
                                        " s. Write the answer to a file first"
                                  : took_too_long(query.time_limit_ms);
}

void QueryPool::end(std::uint64_t ticket, std::string reply) {
  forget(ticket);
  report_({QueryReport::Kind::kAnswered, ticket, std::move(reply)});
}

void QueryPool::forget(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  queue_.remove(ticket);
}

}  // namespace oblique::server
