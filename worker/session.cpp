#include "worker/session.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "worker/solver/solve.h"

namespace oblique::worker {
namespace {

constexpr int kLinger_ms = 500;         ///< maximum time to send the goodbye
constexpr int kMessagesAtATime = 1000;  ///< maximum number of messages in one turn of the loop

std::int64_t now_ms() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
}

protocol::WorkerHello hello_of(const SessionSettings& settings) {
  protocol::WorkerHello hello = settings.hello;
  protocol::set_protocol(hello);
  hello.set_solver_version(solver::solver_version());
  hello.set_instruction_set(solver::instruction_set());
  hello.set_name(settings.name);
  hello.set_threads(static_cast<std::uint32_t>(settings.threads));
  hello.set_host(settings.host);
  return hello;
}

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace

Session::Session(SessionSettings settings, BatchSolver::SolvePoints solve, TraceSolver::Solve trace)
    : settings_(std::move(settings)),
      conversation_(hello_of(settings_), settings_.conversation, settings_.server),
      solver_(
          std::move(solve), [this] { news_.wake(); }, settings_.threads, settings_.slots),
      tracer_(std::move(trace), [this] { news_.wake(); }) {}

int Session::run(int stop_descriptor, const std::function<void()>& on_stop) {
  apply(conversation_.start(now_ms()));
  while (!exit_code_) {
    zmq::pollitem_t items[] = {{link_->socket.handle(), 0, ZMQ_POLLIN, 0},
                               {nullptr, news_.descriptor(), ZMQ_POLLIN, 0},
                               {nullptr, stop_descriptor, ZMQ_POLLIN, 0},
                               {link_->monitor.handle(), 0, ZMQ_POLLIN, 0}};
    const std::int64_t due_ms = std::min(conversation_.next_deadline_ms(), report_due_ms_);
    const std::int64_t timeout_ms = std::max<std::int64_t>(due_ms - now_ms(), 0);
    if (zmq_poll(items, static_cast<int>(std::size(items)), timeout_ms) < 0 && errno != EINTR) {
      throw zmq::error_t();
    }
    if (settings_.on_turn) {
      settings_.on_turn(conversation_.status());
    }
    receive_all();
    if (const auto rejection = link_->monitor.rejection()) {
      apply(conversation_.on_rejected(*rejection, now_ms()));
    }
    if ((items[1].revents & ZMQ_POLLIN) != 0 || now_ms() >= report_due_ms_) {
      news_.clear();
      report_progress();
    }
    if ((items[2].revents & ZMQ_POLLIN) != 0) {
      on_stop();
      report_progress();
      apply(conversation_.stop(now_ms()));
    }
    apply(conversation_.on_time(now_ms()));
    solver_.set_paused(!conversation_.may_solve());
  }
  link_.reset();
  if (has_received_) {
    context_.close();  // waits for the goodbye, at most kLinger_ms
  }
  return *exit_code_;
}

void Session::open_socket() {
  const protocol::DealerSettings settings{
      .url = settings_.server,
      .example_url = SessionSettings().server,
      .linger_ms = kLinger_ms,
      .shortest_pause_ms = static_cast<int>(settings_.conversation.backoff.shortest_ms),
      .longest_pause_ms = static_cast<int>(settings_.conversation.backoff.longest_ms),
      .is_worker = true,
      .key = settings_.key};
  link_.reset();
  link_.emplace(context_, settings);
  attempt_ += std::exchange(has_received_, false) ? 0U : 1U;
  protocol::connect(link_->socket, settings, attempt_);
}

void Session::report_progress() {
  apply(conversation_.on_progress(solver_.collect(), now_ms()));
  apply(conversation_.on_traces(tracer_.collect(), now_ms()));
  report_due_ms_ = now_ms() + settings_.report_interval_ms;
}

void Session::receive_all() {
  for (int i = 0; i < kMessagesAtATime && !exit_code_; ++i) {
    zmq::message_t frame;
    if (!link_->socket.recv(frame, zmq::recv_flags::dontwait)) {
      return;
    }
    protocol::ServerToWorker message;
    if (!protocol::decode({frame.data<char>(), frame.size()}, message)) {
      spdlog::warn("ignored a frame of {} bytes that is not a message", frame.size());
      continue;
    }
    has_received_ = true;
    apply(conversation_.on_message(message, now_ms()));
  }
}

bool Session::send(const protocol::WorkerMessage& message) {
  const std::string frame = protocol::encode(message);
  try {
    return link_->socket.send(zmq::buffer(frame), zmq::send_flags::dontwait).has_value();
  } catch (const zmq::error_t& error) {
    spdlog::warn("sending failed: {}", error.what());
    return false;
  }
}

void Session::apply(Effects effects) {
  bool send_failed = false;
  const Overloaded apply_one{
      [&](const Connect& connect) {
        if (!connect.reason.empty()) {
          spdlog::info("{}: connecting to {} again", connect.reason, settings_.server);
        }
        open_socket();
      },
      [&](const Send& effect) { send_failed = send_failed || !send(effect.message); },
      [&](Solve& effect) { solver_.add(std::move(effect.batch)); },
      [&](const DropStudy& effect) { solver_.drop_study(effect.study_id); },
      [&](const DropBatch& effect) { solver_.drop_batch(effect.number); },
      [&](const DropAll&) {
        solver_.drop_all();
        tracer_.drop_all();
      },
      [&](const SolveTrace& effect) { tracer_.take(effect.order); },
      [&](const CancelTrace& effect) { tracer_.cancel(effect.trace_id); },
      [&](const Note& note) {
        spdlog::log(note.is_warning ? spdlog::level::warn : spdlog::level::info, "{}", note.text);
      },
      [&](const Finish& finish) {
        exit_code_ = finish.exit_code;
        spdlog::log(finish.exit_code == 0 ? spdlog::level::info : spdlog::level::err, "{}",
                    finish.reason);
      }};
  for (Effect& effect : effects) {
    std::visit(apply_one, effect);
  }
  if (send_failed && !exit_code_) {
    apply(conversation_.on_send_failed(now_ms()));
  }
}

}  // namespace oblique::worker
