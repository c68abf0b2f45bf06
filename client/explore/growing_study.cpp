#include "client/explore/growing_study.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Core>

#include "client/commands/shared.h"
#include "client/service/watching.h"
#include "client/study/study.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {

namespace {

/// Whether two blocks have the same points within the tolerance of results. Mathematical libraries
/// round differently on different processors.
bool is_nearly_same(const protocol::Block& stored, protocol::Block given) {
  for (int i = 0; i < std::min(stored.axes_size(), given.axes_size()); ++i) {
    const auto& values = stored.axes(i).values();
    auto& others = *given.mutable_axes(i)->mutable_values();
    if (values.size() == others.size() &&
        Eigen::VectorXd::Map(values.data(), values.size())
            .isApprox(Eigen::VectorXd::Map(others.data(), values.size()), 1e-12)) {
      others = values;
    }
  }
  return protocol::is_same_block(stored, given);
}

}  // namespace

void add_explore_flags(CLI::App& command, ExploreFlags& flags) {
  command
      .add_option("--name", flags.name,
                  "name of the study that holds the points; default: made from the settings")
      ->type_name("NAME");
  add_source_flags(command, flags.source);
  command.get_option("--db")->description(
      fmt::format("database for the points, made when it is not there; default, unless a server is "
                  "named: {}",
                  DatabaseSettings().file));
  add_no_reuse_flag(command, flags.run.no_reuse);
  add_worker_flags(command, flags.run);
}

std::string explored_name(const ExploreFlags& flags, std::string_view verb,
                          std::string_view settings) {
  constexpr std::size_t kDigits = 8;
  if (flags.name.empty()) {
    return fmt::format("{}-{}", verb, protocol::sha256_of(settings).substr(0, kDigits));
  }
  if (const auto error = protocol::study_name_error(flags.name); !error.empty()) {
    throw solver::InputError("--name: " + error);
  }
  return flags.name;
}

int run_exploration(Console& console, const std::function<int(protocol::StopSignals& stop)>& work) {
  protocol::StopSignals stop;
  try {
    return work(stop);
  } catch (const Interrupted&) {
    console.notes() << "Stopped. What was solved is stored; the same command continues.\n";
    return stop.exit_code();
  }
}

GrowingStudy::GrowingStudy(Console& console, const ExploreFlags& flags, std::string name,
                           const solver::ModelParameters& model, protocol::StopSignals& stop)
    : console_(console), stop_(stop), name_(std::move(name)), no_reuse_(flags.run.no_reuse) {
  ConnectionSettings where;
  const bool is_server_named =
      !(flags.source.server + environment_variable("OBLIQUE_SERVER").value_or("")).empty();
  if (is_server_named && flags.source.database.empty()) {
    where = connection_settings(console, flags.source);
  } else {
    ServiceSettings settings = flags.run.service;
    if (!flags.source.database.empty()) {
      settings.database = flags.source.database;
    }
    settings.only_study = name_;
    settings.tell = [&console](const std::string& sentence) { console.note(sentence); };
    refuse_used_database(settings.database);
    service_ = std::make_unique<EmbeddedService>(settings, stop);
    where.server_url = service_->client_url();
    where.key = service_->client_key();
    where.if_silent = why_silent(settings.database);
  }
  connection_ = std::make_unique<Connection>(where, [this] {
    report_service();
    return !stop_.requested();
  });
  *recipe_.mutable_model() = protocol::to_message(model);
  read_stored();
}

GrowingStudy::~GrowingStudy() = default;

void GrowingStudy::report_service() {
  if (service_) {
    service_->check();
    if (const auto news = service_->news(); !news.empty()) {
      console_.notes() << protocol::visible_lines(news) << '\n';
    }
  }
}

bool GrowingStudy::read_stored() {
  const auto found = connection_->query(
      fmt::format("SELECT 1 FROM studies WHERE name = {}", server::sql_text(name_)));
  if (found.rows.empty()) {
    return false;
  }
  stored_ = connection_->describe(name_);
  if (stored_.errors() ||
      stored_.model().SerializeAsString() != recipe_.model().SerializeAsString()) {
    throw solver::InputError(fmt::format(
        "the study \"{}\" exists with another model or with estimated errors: give another --name",
        name_));
  }
  for (int i = 0; i < recipe_.blocks_size(); ++i) {
    if (i == stored_.blocks_size() || !is_nearly_same(stored_.blocks(i), recipe_.blocks(i))) {
      return false;
    }
    *recipe_.mutable_blocks(i) = stored_.blocks(i);
  }
  return true;
}

void GrowingStudy::submit() {
  const auto& longer = stored_.blocks_size() > recipe_.blocks_size() ? stored_ : recipe_;
  const int blocks = longer.blocks_size();
  protocol::check_size(longer);
  protocol::SubmitReply reply;
  try {
    reply = connection_->submit({.name = name_, .recipe = longer}, {.no_reuse = no_reuse_});
  } catch (const std::runtime_error&) {
    // Another client may have added blocks.
    if (!read_stored() || stored_.blocks_size() <= blocks) {
      throw;
    }
    return submit();
  }
  if (std::exchange(is_submitted_, true)) {
    return;
  }
  if (reply.created()) {
    note_coarse_mesh(console_.notes(), recipe_);
    note_unusual_values(console_.notes(), recipe_);
  } else {
    console_.notes() << fmt::format("Continuing \"{}\": {} of {} points are done.\n", name_,
                                    format_count(reply.completed()), format_count(reply.points()));
  }
}

void GrowingStudy::wait(const std::string& what) {
  FollowedStudy followed(*connection_, name_);
  const auto ask = [&](const Tell& tell) {
    report_service();
    auto status = followed.status(tell);
    if (const auto reason = objection_to_waiting(status); service_ && !reason.empty()) {
      throw std::runtime_error(reason);
    }
    status.set_name(fmt::format("{}, {}", name_, what));
    return status;
  };
  const auto status = watch_study(console_, ask, stop_);
  if (stop_.requested()) {
    throw Interrupted("stopped");
  }
  if (status.state() == "cancelled") {
    throw std::runtime_error(
        fmt::format("the study \"{}\" was cancelled: the same command continues it", name_));
  }
}

protocol::Table GrowingStudy::solve(const protocol::Block& block, const std::string& columns,
                                    const std::string& what) {
  const int round = recipe_.blocks_size();
  const bool is_stored = round < stored_.blocks_size();
  if (is_stored && !is_nearly_same(stored_.blocks(round), block)) {
    throw solver::InputError(fmt::format(
        "the study \"{}\" exists and its block {} has other points than this command: give another "
        "--name",
        name_, round + 1));
  }
  *recipe_.add_blocks() = is_stored ? stored_.blocks(round) : block;
  const std::uint64_t first = std::exchange(points_, points_ + protocol::points_of_block(block));
  const auto results = [&] {
    protocol::Table table;
    for (const auto& chunk : connection_->chunks(request_for({.study = name_,
                             .where = fmt::format("point BETWEEN {} AND {}", first, points_ - 1),
                             .select = columns}))) {
      protocol::append_rows(chunk, table);
    }
    return table;
  };
  if (!is_stored || !is_submitted_) {
    submit();
    wait(what);
  }
  auto table = results();
  if (table.rows.size() != points_ - first) {
    wait(what);  // another client has added the block, and has not all of its results
    table = results();
  }
  if (table.rows.size() != points_ - first) {
    throw std::runtime_error(
        fmt::format("the study \"{}\" has {} of the {} points of its block {}; another command may "
                    "have renamed or deleted it. The same command solves them again",
                    name_, table.rows.size(), points_ - first, round + 1));
  }
  return table;
}

protocol::Block listed_points(const std::vector<std::string>& keys,
                              const std::vector<std::vector<double>>& values,
                              std::vector<protocol::Axis> others) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    others.push_back(protocol::listed_axis(protocol::axis_key(keys[i]), values.at(i)));
  }
  auto block = protocol::block_of(std::move(others));
  block.set_zip(true);
  return block;
}

}  // namespace oblique::client
