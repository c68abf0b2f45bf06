#include "tests/bench/load/load_generator.h"

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "proto/socket/socket.h"
#include "proto/system/descriptor.h"
#include "worker/conversation.h"
#include "worker/solver/solve.h"

namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

/// Number of results in one message of a real worker.
constexpr std::uint64_t kResultsPerTurn = 1000;
/// Interval at which real workers report while they solve a batch.
constexpr double kReportInterval_s = 0.1;

double now_s() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

std::int64_t now_ms() {
  return static_cast<std::int64_t>(1e3 * now_s());
}

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

protocol::WorkerHello hello_of(std::size_t number) {
  protocol::WorkerHello hello;
  protocol::set_protocol(hello);
  hello.set_solver_version(solver::solver_version());
  hello.set_instruction_set(solver::instruction_set());
  hello.set_name("load:" + std::to_string(number));
  hello.set_threads(1);
  hello.set_process_id("load " + std::to_string(number));
  return hello;
}

protocol::PointResult solved_result() {
  return protocol::to_message(0, solver::Finger(solver::preset("paper")).solve(1.0, 0.4, 0.8));
}

}  // namespace

class LoadGenerator::Parts {
 public:
  explicit Parts(const LoadSettings& settings)
      : settings_(settings), result_(solved_result()), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
    context_.set(zmq::ctxopt::max_sockets, 4 * static_cast<int>(settings.workers) + 64);
    for (std::size_t number = 0; number < settings.workers; ++number) {
      members_.push_back(std::make_unique<Member>(hello_of(number)));
    }
    thread_ = std::thread([this] { run(); });
  }
  ~Parts() {
    stopping_ = true;
    thread_.join();
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  LoadCounts counts() const { return {batches_, results_, messages_, connects_, welcomed_}; }

 private:
  struct Job {
    worker::Batch batch;
    std::uint64_t done = 0;  // reported points
  };
  struct Member {
    explicit Member(protocol::WorkerHello hello) : conversation(std::move(hello), {}) {}
    worker::Conversation conversation;
    std::optional<zmq::socket_t> socket;
    std::deque<Job> jobs;
    double solving_since_s = 0.0;  // when the first job's first unreported point began
  };

  void run() {
    for (std::size_t number = 0; number < members_.size(); ++number) {
      apply(number, members_[number]->conversation.start(now_ms()));
      work_on(number);
    }
    std::array<epoll_event, 256> events;
    double next_sweep_s = now_s();
    while (!stopping_) {
      const int count = epoll_wait(epoll_.number(), events.data(), events.size(), 5);
      for (int i = 0; i < count; ++i) {
        work_on(events[static_cast<std::size_t>(i)].data.u64);
      }
      constexpr double kSweep_s = 0.01;
      if (now_s() >= next_sweep_s) {
        const double late_s = now_s() - next_sweep_s;
        longest_gap_s_ = std::max(longest_gap_s_.load(), late_s);
        next_sweep_s = now_s() + kSweep_s;
        sweep();
      }
    }
    for (auto& member : members_) {
      member->socket.reset();
    }
  }

  void sweep() {
    for (std::size_t number = 0; number < members_.size(); ++number) {
      Member& member = *members_[number];
      const bool is_due = member.conversation.next_deadline_ms() <= now_ms();
      if (!member.jobs.empty() || is_due) {
        work_on(number);
        apply(number, member.conversation.on_time(now_ms()));
        receive_all(number);
      }
    }
  }

  /// Receives messages and reports due points, repeatedly, until neither is left. The repetition is
  /// needed because sending may clear the readiness of the descriptor (ZMQ_FD is edge-triggered).
  void work_on(std::size_t number) {
    receive_all(number);
    while (report_due(number) && receive_all(number)) {
    }
  }

  bool receive_all(std::size_t number) {
    Member& member = *members_[number];
    zmq::message_t frame;
    bool any = false;
    while (member.socket->recv(frame, zmq::recv_flags::dontwait)) {
      any = true;
      protocol::ServerToWorker message;
      if (!protocol::decode({frame.data<char>(), frame.size()}, message)) {
        continue;
      }
      welcomed_ += message.has_welcome() ? 1U : 0U;
      apply(number, member.conversation.on_message(message, now_ms()));
    }
    return any;
  }

  /// Reports solved points of the first batch in at most one message. Returns false if no report is
  /// due.
  bool report_due(std::size_t number) {
    Member& member = *members_[number];
    if (member.jobs.empty() || !member.conversation.may_solve()) {
      return false;
    }
    Job& job = member.jobs.front();
    const std::uint64_t left = job.batch.size() - job.done;
    // Sends at most one message, so that other workers get their turn.
    std::uint64_t solved = std::min<std::uint64_t>(left, kResultsPerTurn);
    const double elapsed_s = now_s() - member.solving_since_s;
    if (settings_.point_s > 0.0) {
      solved = std::min(solved, static_cast<std::uint64_t>(elapsed_s / settings_.point_s));
      if (solved < std::min(left, kResultsPerTurn) &&
          (elapsed_s < kReportInterval_s || solved == 0)) {
        return false;
      }
    }
    worker::Progress progress{job.batch.number(), job.batch.study_id(), {}, 0.0, solved == left};
    progress.study_uid = job.batch.study_uid();
    progress.results.assign(solved, result_);
    for (std::uint64_t i = 0; i < solved; ++i) {
      progress.results[i].set_point(job.batch.point_at(job.done + i));
      protocol::set_inputs(progress.results[i], job.batch.points());
    }
    const double points = static_cast<double>(solved);
    progress.busy_s = settings_.point_s > 0.0 ? points * settings_.point_s : points * 1e-6;
    member.solving_since_s += points * settings_.point_s;
    job.done += solved;
    results_ += solved;
    if (solved == left) {
      member.jobs.pop_front();
      if (settings_.point_s == 0.0 || member.jobs.empty()) {
        member.solving_since_s = now_s();
      }
    }
    apply(number, member.conversation.on_progress({std::move(progress)}, now_ms()));
    return true;
  }

  void connect(std::size_t number) {
    Member& member = *members_[number];
    const protocol::DealerSettings settings{.url = settings_.worker_url,
                                            .example_url = settings_.worker_url,
                                            .is_worker = true,
                                            .key = settings_.key};
    member.socket.reset();
    member.socket = protocol::make_dealer(context_, settings);
    protocol::connect(*member.socket, settings);
    epoll_event event{EPOLLIN, {.u64 = number}};
    epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, member.socket->get(zmq::sockopt::fd), &event);
    ++connects_;
  }

  void send(Member& member, const protocol::WorkerMessage& message) {
    ++messages_;
    member.socket->send(zmq::buffer(protocol::encode(message)), zmq::send_flags::dontwait);
  }

  void apply(std::size_t number, worker::Effects effects) {
    Member& member = *members_[number];
    const auto drop = [&member](const auto& is_dropped) {
      std::erase_if(member.jobs, [&](const Job& job) { return is_dropped(job.batch); });
    };
    const Overloaded apply_one{
        [&](const worker::Connect& effect) {
          constexpr std::uint64_t kMaxReported = 5;
          if (!effect.reason.empty() && connects_ < members_.size() + kMaxReported) {
            std::fprintf(stderr, "worker %zu reconnects: %s\n", number, effect.reason.c_str());
          }
          connect(number);
        },
        [&](const worker::Send& effect) { send(member, effect.message); },
        [&](worker::Solve& effect) {
          if (member.jobs.empty()) {
            member.solving_since_s = now_s();
          }
          ++batches_;
          member.jobs.push_back({std::move(effect.batch)});
        },
        [&](const worker::DropStudy& effect) {
          drop([&](const worker::Batch& batch) { return batch.study_id() == effect.study_id; });
        },
        [&](const worker::DropBatch& effect) {
          drop([&](const worker::Batch& batch) { return batch.number() == effect.number; });
        },
        [&](const worker::DropAll&) { member.jobs.clear(); },
        [](const worker::SolveTrace&) {},
        [](const worker::CancelTrace&) {},
        [](const worker::Note&) {},
        [](const worker::Finish& finish) {
          std::fprintf(stderr, "a worker ended: %s\n", finish.reason.c_str());
        }};
    for (worker::Effect& effect : effects) {
      std::visit(apply_one, effect);
    }
  }

  LoadSettings settings_;
  protocol::PointResult result_;
  zmq::context_t context_;
  protocol::Descriptor epoll_;
  std::vector<std::unique_ptr<Member>> members_;
  std::atomic<std::uint64_t> batches_ = 0;
  std::atomic<std::uint64_t> results_ = 0;
  std::atomic<std::uint64_t> messages_ = 0;
  std::atomic<std::uint64_t> connects_ = 0;
  std::atomic<std::uint64_t> welcomed_ = 0;
  std::atomic<double> longest_gap_s_ = 0.0;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;  // declared last, because it uses the other members
};

std::size_t bytes_of_result() {
  return solved_result().ByteSizeLong();
}

LoadGenerator::LoadGenerator(const LoadSettings& settings)
    : parts_(std::make_unique<Parts>(settings)) {}
LoadGenerator::~LoadGenerator() = default;

LoadCounts LoadGenerator::counts() const {
  return parts_->counts();
}

}  // namespace oblique::bench
