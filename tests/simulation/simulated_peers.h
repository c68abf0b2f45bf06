#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/store/changes.h"
#include "tests/simulation/world.h"
#include "tests/support/recipes.h"
#include "worker/conversation.h"

namespace oblique::simulation {

constexpr double kMarkInH = 0x1p-20;

inline std::uint64_t mark_of(double H) {
  return static_cast<std::uint64_t>((H - 1.0) / kMarkInH);
}

/// Returns the drop H of all points of a study. H encodes `mark`, which identifies the study.
inline double marked_H(std::uint64_t mark) {
  return 1.0 + static_cast<double>(mark) * kMarkInH;
}

/// Returns an invented result for a point. Its values contain the mark of the study and the point.
inline protocol::PointResult answer_to(std::uint64_t mark, std::uint64_t point) {
  solver::CaseResult result{};
  result.duration_s = static_cast<double>(mark);
  result.fn_peak_N = static_cast<double>(point);
  return protocol::to_message(point, result);
}

/// A worker with a simulated solver that runs the real protocol code. It can be killed, frozen or
/// stopped, and is always restarted.
class SimulatedWorker {
 public:
  /// `peer` is the worker's number in the network. Some workers need longer for the first point of
  /// a model. If `leaves` is true, the worker sometimes leaves after a time limit, and another one
  /// starts.
  SimulatedWorker(World& world, Network& network, std::uint64_t peer, bool leaves)
      : world_(world),
        network_(network),
        peer_(peer),
        leaves_(leaves),
        ms_per_point_(world.chance(0.2) ? world.between(50, 400) : world.between(1, 20)),
        ms_per_fall_(world.chance(0.3) ? world.between(5, 50) : 0) {}

  /// Kills the process if it runs, and starts another after `away_ms`. Sometimes the other one
  /// reports that the solver crashed.
  void restart(std::int64_t away_ms) {
    note_crash();
    ++life_;
    ++sockets_;
    network_.close(link_, world_.chance(0.5));
    link_ = 0;
    batches_.clear();
    solving_ = false;
    fallen_model_ = {};
    frozen_until_ms_ = 0;
    conversation_.reset();
    sent_.clear();
    world_.after(away_ms, [this, life = life_] {
      if (life == life_) {
        start();
      }
    });
  }
  /// Freezes the process for a while, as SIGSTOP does.
  void freeze(std::int64_t duration_ms) { frozen_until_ms_ = world_.now_ms() + duration_ms; }
  void stop() {
    if (conversation_) {
      apply(conversation_->stop(world_.now_ms()));
    }
  }

  /// Returns the results that the socket `link` sent in message `sequence`, or nullptr.
  const protocol::Results* sent(Network::LinkId link, std::uint64_t sequence) const {
    const auto found = sent_.find({link, sequence});
    return found == sent_.end() ? nullptr : &found->second;
  }
  bool holds_nothing() const { return batches_.empty(); }
  std::uint64_t reported_crashes = 0;

 private:
  struct Work {
    worker::Batch batch;
    std::uint64_t solved;  ///< number of leading positions of `batch` that are solved or left out
  };
  /// Prepares the report of a crash on several points. A point on which the solver crashed alone
  /// would fail.
  void note_crash() {
    replaced_.clear_points();
    replaced_.set_process_id(process_id());
    replaced_.set_signal(9);
    if (batches_.empty() || world_.chance(0.5)) {
      return;
    }
    const Work& work = batches_.front();
    for (std::uint64_t i = work.solved; i < std::min(work.solved + 3, work.batch.size()); ++i) {
      replaced_.add_points(work.batch.study_id());
      replaced_.add_points(work.batch.point_at(i));
    }
    if (replaced_.points_size() > 2) {
      replaced_.set_signal(11);
      ++reported_crashes;
    } else {
      replaced_.clear_points();
    }
  }
  std::string process_id() const {
    return std::to_string(peer_) + " in life " + std::to_string(life_);
  }
  void start() {
    protocol::WorkerHello hello;
    protocol::set_protocol(hello);
    hello.set_solver_version("1");
    hello.set_threads(1);
    ++life_;
    hello.set_process_id(process_id());
    *hello.mutable_replaced() = replaced_;
    planned_time_ms_ = -1;
    worker::ConversationSettings settings;
    if (leaves_ && world_.chance(0.2)) {
      settings.exit.stop_ms = world_.now_ms() + world_.between(0, 57'000);
    }
    conversation_.emplace(hello, settings);
    apply(conversation_->start(world_.now_ms()));
  }
  /// Runs `what` as soon as the process is not frozen. Drops `what` if a new process starts first.
  void when_awake(std::function<void()> what) {
    if (world_.now_ms() >= frozen_until_ms_) {
      what();
      return;
    }
    world_.after(frozen_until_ms_ - world_.now_ms(), [this, life = life_, what = std::move(what)] {
      if (life == life_) {
        when_awake(what);
      }
    });
  }
  void apply(worker::Effects effects) {
    for (worker::Effect& effect : effects) {
      if (std::holds_alternative<worker::Connect>(effect)) {
        network_.close(link_, true);
        const std::uint64_t socket = ++sockets_;
        link_ = network_.open(peer_, [this, socket](const std::string& frame) {
          when_awake([this, socket, frame] {
            protocol::ServerToWorker message;
            if (socket == sockets_ && protocol::decode(frame, message)) {
              apply(conversation_->on_message(message, world_.now_ms()));
            }
          });
        });
      } else if (auto* send = std::get_if<worker::Send>(&effect)) {
        const bool is_results = send->message.has_results();
        if (is_results) {
          sent_[{link_, send->message.results().sequence()}] = send->message.results();
        }
        network_.send(link_, protocol::encode(send->message),
                      is_results || send->message.has_heartbeat());
      } else if (auto* solve = std::get_if<worker::Solve>(&effect)) {
        batches_.push_back({std::move(solve->batch), 0});
      } else if (const auto* drop = std::get_if<worker::DropStudy>(&effect)) {
        std::erase_if(batches_,
                      [&](const Work& w) { return w.batch.study_id() == drop->study_id; });
      } else if (const auto* batch = std::get_if<worker::DropBatch>(&effect)) {
        std::erase_if(batches_, [&](const Work& w) { return w.batch.number() == batch->number; });
      } else if (std::holds_alternative<worker::DropAll>(effect)) {
        batches_.clear();
      } else if (std::holds_alternative<worker::Finish>(effect)) {
        restart(world_.between(10, 2000));
        return;
      }
    }
    plan_time();
    plan_solving();
  }
  void plan_time() {
    const std::int64_t due_ms = conversation_->next_deadline_ms();
    if (planned_time_ms_ >= world_.now_ms() && planned_time_ms_ <= due_ms) {
      return;
    }
    planned_time_ms_ = due_ms;
    world_.after(std::max<std::int64_t>(due_ms - world_.now_ms(), 0), [this, life = life_, due_ms] {
      if (life != life_ || due_ms != planned_time_ms_) {
        return;
      }
      when_awake([this, life] {
        if (life == life_) {
          planned_time_ms_ = -1;
          apply(conversation_->on_time(world_.now_ms()));
        }
      });
    });
  }
  void plan_solving() {
    if (solving_ || batches_.empty() || !conversation_->may_solve()) {
      return;
    }
    solving_ = true;
    busy_ms_ = ms_per_point_ + (next_model() == fallen_model_ ? 0 : ms_per_fall_);
    world_.after(busy_ms_, [this, life = life_] {
      if (life == life_) {
        when_awake([this, life] {
          if (life == life_) {
            solving_ = false;
            solve_some();
          }
        });
      }
    });
  }
  void solve_some() {
    if (batches_.empty()) {
      return;
    }
    Work& work = batches_.front();
    const std::uint64_t position = next_position(work);
    worker::Progress progress{work.batch.number(),
                              work.batch.study_id(),
                              {},
                              1e-3 * static_cast<double>(busy_ms_),
                              false,
                              {},
                              work.batch.attempt(),
                              work.batch.study_uid()};
    work.batch.append_points(work.solved, position, progress.left_out);
    if (position < work.batch.size()) {
      const std::uint64_t point = work.batch.point_at(position);
      const std::uint64_t mark = mark_of(work.batch.points().point(point).H_m);
      fallen_model_ = next_model();
      work.solved = position + 1;
      progress.results.push_back(answer_to(mark, point));
      protocol::set_inputs(progress.results.back(), work.batch.points());
    }
    progress.batch_done = next_position(work) == work.batch.size();
    if (progress.batch_done) {
      work.batch.append_points(std::max(work.solved, position), work.batch.size(),
                               progress.left_out);
    }
    if (progress.batch_done) {
      batches_.pop_front();
    }
    std::vector<worker::Progress> all;
    all.push_back(std::move(progress));
    apply(conversation_->on_progress(std::move(all), world_.now_ms()));
  }
  /// Returns the position of the next point that passes the study's filter, or the batch's size.
  static std::uint64_t next_position(const Work& work) {
    return work.batch.first_to_solve(work.solved, work.batch.size());
  }
  std::pair<std::uint64_t, std::uint64_t> next_model() const {
    const Work& work = batches_.front();
    const std::uint64_t position = next_position(work);
    if (position == work.batch.size()) {
      return fallen_model_;
    }
    const std::uint64_t point = work.batch.point_at(position);
    return {work.batch.study_id(), work.batch.points().point(point).model};
  }

  World& world_;
  Network& network_;
  std::uint64_t peer_;
  bool leaves_;
  std::int64_t ms_per_point_;
  std::int64_t ms_per_fall_;
  std::int64_t busy_ms_ = 0;                                // solving time of the present point
  std::pair<std::uint64_t, std::uint64_t> fallen_model_{};  // study and model solved last
  std::optional<worker::Conversation> conversation_;
  Network::LinkId link_ = 0;
  std::deque<Work> batches_;
  bool solving_ = false;
  std::int64_t frozen_until_ms_ = 0;
  std::int64_t planned_time_ms_ = -1;
  protocol::EndedProcess replaced_;
  std::uint64_t life_ = 0;     // number of processes; events of earlier processes are ignored
  std::uint64_t sockets_ = 0;  // number of sockets; messages of earlier sockets are ignored
  std::map<std::pair<Network::LinkId, std::uint64_t>, protocol::Results> sent_;
};

using server::StudyState;

/// Returns a recipe of `points` points with this H. Each model has `points_per_model` points; the
/// last model has the remaining points. E determines the fall and cycles through three values, so
/// models with the same fall are not neighbours.
inline protocol::Recipe recipe_of_models(std::uint64_t points, std::uint64_t points_per_model,
                                         double H) {
  using protocol::listed;
  using protocol::range;
  const auto axis = [](const char* key, double from, double to, std::uint64_t count) {
    return count == 1 ? listed(key, {from}) : range(key, from, to, count);
  };
  const std::uint64_t models = points / points_per_model;
  const std::uint64_t rest = points % points_per_model;
  std::vector<std::vector<protocol::Axis>> blocks;
  if (models > 0) {
    blocks.push_back(
        {axis("k", 1e7, 2e7, models),
         protocol::following("E", "6e10 + 1e9 * (floor(k / 3e5) - 3 * floor(floor(k / 3e5) / 3))"),
         listed("H", {H}), axis("mu", 0.5, 1.0, points_per_model), listed("e", {1.0})});
  }
  if (rest > 0) {
    blocks.push_back({listed("H", {H}), axis("mu", 0.0, 0.4, rest), listed("e", {1.0})});
  }
  return protocol::recipe_of(blocks);
}

/// Adds `filter` to each block of `recipe`. Returns nothing if the filter leaves out all points of
/// a block.
inline std::optional<protocol::PointTable> filtered_table(protocol::Recipe recipe,
                                                          const char* filter) {
  for (protocol::Block& block : *recipe.mutable_blocks()) {
    block.set_where(filter);
  }
  try {
    protocol::PointTable table(std::move(recipe));
    table.validate_points();
    return table;
  } catch (const solver::InputError&) {
    return std::nullopt;
  }
}

/// A client that repeats the submission of one study until it is acknowledged, and sometimes
/// cancels and continues the study. During faults it sometimes appends points, renames the study,
/// or deletes it and submits a new study with its name.
class SimulatedClient {
 public:
  /// `peer` is the client's number in the network. `mark` identifies the results of its study
  /// (answer_to). If a new study replaces a deleted one, `mark` grows by `kClients`. Most studies
  /// have several models.
  SimulatedClient(World& world, Network& network, std::uint64_t peer, std::string name,
                  std::uint64_t points, std::uint64_t mark)
      : world_(world), network_(network), peer_(peer), name_(std::move(name)), mark_(mark) {
    set_recipe(points);
  }
  static constexpr std::uint64_t kClients = 8;  ///< maximum number of clients

  void start() {
    connect();
    world_.after(world_.between(0, 5000), [this] {
      ++request_;
      send_request();
    });
    world_.after(world_.between(3000, 20'000), [this] { begin_next_request(); });
  }

  const std::string& name() const { return name_; }
  std::uint64_t points() const { return points_; }
  /// Returns the number of points that pass the filters.
  std::uint64_t left_in() const { return left_in_; }
  std::uint64_t mark() const { return mark_; }
  /// Returns true if a submission was acknowledged.
  bool was_acknowledged() const { return acknowledged_; }
  /// Checks the study's state after a restart of the server. Throws Violation unless it is the last
  /// acknowledged state or a state requested later.
  void check_found(server::StudyState state) const {
    if (possible_ && state != StudyState::kDone && !possible_->contains(state)) {
      throw Violation("an acknowledged change of " + name_ + " was forgotten: it is " +
                      server::state_name(state));
    }
  }
  /// Returns true if the last request is a submission that was acknowledged.
  bool wants_results() const { return acknowledged_ && intent_ == Intent::kSubmit && is_answered_; }
  std::uint64_t growths = 0;
  std::uint64_t renamings = 0;
  std::uint64_t deletions = 0;

 private:
  enum class Intent { kSubmit, kChange, kRename, kDelete };

  void connect() {
    // Drops unsent messages of the old socket, because a late request would undo later changes.
    network_.close(link_, false);
    link_ = network_.open(peer_, [this](const std::string& frame) { answered(frame); });
  }
  /// Appends `points` points to the recipe, which is empty at first. A filter may leave out some of
  /// these points.
  void set_recipe(std::uint64_t points) {
    points_ += points;
    const std::uint64_t points_per_model = world_.chance(0.3) ? points + 1
                                           : world_.chance(0.5)
                                               ? std::uint64_t{1}
                                               : static_cast<std::uint64_t>(world_.between(2, 40));
    const protocol::Recipe recipe = recipe_of_models(points, points_per_model, marked_H(mark_));
    if (world_.chance(0.4)) {
      const char* filter = world_.chance(0.3) ? "sin(1234.5 * mu + k) > 0.9"  // few points pass
                                              : "sin(1234.5 * mu + k) > -0.3";
      if (const auto table = filtered_table(recipe, filter)) {
        recipe_.mutable_blocks()->MergeFrom(table->recipe().blocks());
        for (std::uint64_t point = 0; point < points; ++point) {
          left_in_ += table->passes_filter(point) ? 1U : 0U;
        }
        return;
      }
    }
    recipe_.mutable_blocks()->MergeFrom(recipe.blocks());
    left_in_ += points;
  }
  void grow() {
    appended_ = static_cast<std::uint64_t>(world_.between(1, 60));
    set_recipe(appended_);
  }
  /// Makes a new study with the name of the deleted one.
  void replace_deleted_study() {
    acknowledged_ = false;
    study_id_ = 0;
    mark_ += kClients;
    recipe_.clear_blocks();
    points_ = 0;
    left_in_ = 0;
    set_recipe(static_cast<std::uint64_t>(world_.between(1, 300)));
  }
  void send_request() {
    if (is_answered_) {
      return;
    }
    protocol::ClientRequest request;
    request.set_protocol_version(protocol::kProtocolVersion);
    request.set_request_id(request_);
    if (intent_ == Intent::kRename || intent_ == Intent::kDelete) {
      request.mutable_change()->set_study(name_);
      request.mutable_change()->set_study_id(study_id_);
      request.mutable_change()->set_new_name(new_name_);
      request.mutable_change()->set_change(intent_ == Intent::kRename
                                               ? protocol::STUDY_CHANGE_RENAME
                                               : protocol::STUDY_CHANGE_DELETE);
    } else if (intent_ == Intent::kChange) {
      request.mutable_change()->set_study(name_);
      // Draws one of cancel, pause, resume and retry.
      const auto change = static_cast<protocol::StudyChange>(world_.between(1, 4));
      request.mutable_change()->set_change(change);
      expect(change);
    } else {
      expect(protocol::STUDY_CHANGE_RESUME);
      request.mutable_submit()->set_name(name_);
      // No reuse, because StoreModel does not model rows that are copied from other studies.
      request.mutable_submit()->set_no_reuse(true);
      if (world_.chance(0.3)) {
        // A submission with another priority changes the study's priority. The change is durable
        // before the reply.
        request.mutable_submit()->set_priority(static_cast<std::int32_t>(world_.between(-2, 2)));
      }
      *request.mutable_submit()->mutable_recipe() = recipe_;
    }
    network_.send(link_, protocol::encode(request), false);
    world_.after(2000, [this, number = request_] {
      if (number == request_ && !is_answered_) {
        connect();
        send_request();
      }
    });
  }
  void answered(const std::string& frame) {
    protocol::ClientReply reply;
    if (!protocol::decode(frame, reply) || reply.request_id() != request_ || is_answered_) {
      return;
    }
    if (reply.has_error()) {
      if (acknowledged_ && reply.error().message().find("not stored") == std::string::npos) {
        throw Violation("an acknowledged study is refused: " + reply.error().message());
      }
      return;  // the client sends the request again
    }
    is_answered_ = true;
    if (reply.has_submit()) {
      if (acknowledged_ && reply.submit().created()) {
        throw Violation("an acknowledged study was forgotten");
      }
      if (reply.submit().points() != points_ ||
          (reply.submit().appended() != 0 && reply.submit().appended() != appended_)) {
        throw Violation("a study of " + std::to_string(points_) + " points, " +
                        std::to_string(appended_) + " of them appended, is reported as " +
                        std::to_string(reply.submit().points()) + " points, " +
                        std::to_string(reply.submit().appended()) + " appended");
      }
      acknowledged_ = true;
      study_id_ = reply.submit().study_id();
      possible_ = {StudyState::kRunning};
      return;
    }
    if (intent_ == Intent::kRename) {
      if (reply.change().study().name() != new_name_) {
        throw Violation("a renamed study is called " + reply.change().study().name());
      }
      name_ = new_name_;
      return;
    }
    if (intent_ == Intent::kDelete) {
      replace_deleted_study();
      return;
    }
    const std::string& state_name_of_reply = reply.change().study().state();
    for (const StudyState state :
         {StudyState::kRunning, StudyState::kPaused, StudyState::kCancelled}) {
      if (state_name_of_reply == server::state_name(state)) {
        // If several changes are pending, the state may come from any of them.
        possible_ = requested_.size() > 1 ? std::nullopt : std::optional(std::set{state});
        return;
      }
    }
    possible_.reset();
  }
  void begin_next_request() {
    // After the end of faults the client submits the study for the last time.
    const bool last = !world_.faults;
    if (is_answered_ && (!last || intent_ != Intent::kSubmit)) {
      const bool is_free = !last && intent_ == Intent::kSubmit && acknowledged_;
      intent_ = Intent::kSubmit;
      appended_ = 0;
      if (is_free && world_.chance(0.3)) {
        intent_ = Intent::kChange;
      } else if (is_free && world_.chance(0.15)) {
        intent_ = Intent::kRename;
        new_name_ = name_.ends_with("'") ? name_.substr(0, name_.size() - 1) : name_ + "'";
        ++renamings;
      } else if (is_free && world_.chance(0.15)) {
        intent_ = Intent::kDelete;
        possible_.reset();
        ++deletions;
      } else if (is_free && world_.chance(0.3)) {
        grow();
        ++growths;
      }
      is_answered_ = false;
      requested_.clear();
      ++request_;
      send_request();
    }
    if (!last || !is_answered_ || intent_ != Intent::kSubmit) {
      world_.after(world_.between(500, 4000), [this] { begin_next_request(); });
    }
  }
  void expect(protocol::StudyChange change) {
    requested_.insert(change);
    if (possible_) {
      possible_->insert(change == protocol::STUDY_CHANGE_CANCEL  ? StudyState::kCancelled
                        : change == protocol::STUDY_CHANGE_PAUSE ? StudyState::kPaused
                                                                 : StudyState::kRunning);
    }
  }

  World& world_;
  Network& network_;
  std::uint64_t peer_;
  std::string name_;
  std::uint64_t points_ = 0;
  std::uint64_t left_in_ = 0;  // number of points that pass the filters
  std::uint64_t mark_;
  std::uint64_t study_id_ = 0;  // from the acknowledgement
  std::string new_name_;
  std::uint64_t appended_ = 0;  // number of points that the request appends
  protocol::Recipe recipe_ = protocol::recipe_of({});
  Network::LinkId link_ = 0;
  std::uint64_t request_ = 0;
  bool acknowledged_ = false;
  Intent intent_ = Intent::kSubmit;  // purpose of the last request
  bool is_answered_ = false;         // the last request was answered
  // changes sent with the present request number; a repeated request may contain another change
  std::set<protocol::StudyChange> requested_;
  /// States that the study may have: the last acknowledged state and the states requested later.
  /// Done is always possible. Without a value all states are possible.
  std::optional<std::set<server::StudyState>> possible_;
};

}  // namespace oblique::simulation
