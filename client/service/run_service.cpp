#include "client/service/run_service.h"

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/io/study_notes.h"
#include "client/service/connection.h"
#include "client/service/result_query.h"
#include "client/service/watching.h"
#include "proto/study_counts.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/version.h"

namespace oblique::client {
namespace {

void tell_how_to_continue(Console& console, const Study& study, const RunSettings& settings) {
  console.notes() << fmt::format(
      "Stopped. What was solved of \"{}\" is in {}; the same command again goes on from there.\n",
      study.name, settings.service.database.string());
}

/// Rows that were not merged into the file are missing in a copy of it.
void tell_of_log(Console& console, const std::filesystem::path& database) {
  std::error_code ignored;
  const std::string log = database.string() + "-wal";
  const auto size = std::filesystem::file_size(log, ignored);
  if (!ignored && size > 0) {
    console.notes() << fmt::format(
        "Another program reads {0}, so {1} holds some of its rows: a copy needs both files. "
        "`oblique backup COPY.db --db {0}` makes one that is whole.\n",
        database.string(), log);
  }
}

/// Why the rest of a study is not solved by the workers of this run, and what to do; empty: it is.
std::string objection_to_waiting(const protocol::StudyStatus& status) {
  const std::string own = solver::solver_version();
  if (status.state() == "paused" && status.leased() == 0) {
    return fmt::format("somebody has paused \"{}\": the same command again goes on with it",
                       status.name());
  }
  if (status.state() != "running" || status.solver_version().empty() ||
      status.solver_version() == own || status.leased() > 0) {
    return {};
  }
  return fmt::format(
      "the results of \"{0}\" are of solver {1}, and the workers here have {2}: nobody here may "
      "solve its other {3} points. Go on with workers of {1}, or under another name, as --name "
      "{0}-{2}",
      status.name(), status.solver_version(), own, format_count(protocol::open_points(status)));
}

/// Names the other studies of the database that are not finished. They wait during this run.
void tell_of_other_studies(Console& console, Connection& connection, const Study& study,
                           const std::filesystem::path& database) {
  constexpr std::size_t kMostNamed = 3;
  std::vector<std::string> others;
  const auto all = connection.status({});
  for (const auto& other : all.studies()) {
    if (other.name() != study.name && other.state() == "running") {
      others.push_back(fmt::format("{} ({} points open)", other.name(),
                                   format_count(protocol::open_points(other))));
    }
  }
  if (others.empty()) {
    return;
  }
  std::string more;
  if (others.size() > kMostNamed) {
    more = fmt::format(" and {} more", format_count(others.size() - kMostNamed));
    others.resize(kMostNamed);
  }
  console.note(fmt::format(
      "Also unfinished in {0}: {1}{2}. To go on with one, repeat the `oblique run` that "
      "began it; `oblique view {0}` goes on with all.",
      database.string(), fmt::join(others, ", "), more));
}

RunEnd submit_and_wait(Console& console, const Study& study, const RunSettings& settings,
                       EmbeddedService& service, protocol::StopSignals& stop) {
  const auto look_after = [&] {
    service.check();
    if (const auto news = service.news(); !news.empty()) {
      console.notes() << protocol::visible_lines(news) << '\n';
    }
    return !stop.requested();
  };
  ConnectionSettings where;
  where.server_url = service.client_url();
  where.key = service.client_key();
  where.if_silent = why_silent(settings.service.database);
  Connection connection(where, look_after);
  const auto submitted = connection.submit(study, {.no_reuse = settings.no_reuse});
  if (submitted.created()) {
    note_coarse_mesh(console.notes(), study.recipe);
  } else {
    console.notes() << fmt::format("Going on with \"{}\": {} of {} points are done.\n", study.name,
                                   format_count(submitted.settled()),
                                   format_count(submitted.points()));
  }
  if (const std::string taken = taken_over(submitted.taken()); !taken.empty()) {
    console.notes() << fmt::format("\"{}\": {}\n", study.name, taken);
  }
  tell_of_other_studies(console, connection, study, settings.service.database);
  const auto ask = [&](const Tell& tell) {
    look_after();
    const auto reply = connection.status(study.name, tell);
    if (reply.studies_size() != 1) {
      throw ServerError(fmt::format("the server no longer knows the study \"{}\"", study.name));
    }
    if (const auto reason = objection_to_waiting(reply.studies(0)); !reason.empty()) {
      throw std::runtime_error(reason);
    }
    return reply.studies(0);
  };
  RunEnd end;
  end.status = watch_study(console, ask, stop);
  if (stop.requested()) {
    throw Interrupted("stopped");
  }
  const Tell tell = [&console](const std::string& sentence) { console.note(sentence); };
  const auto query = [&](const std::string& sql) { return connection.query(sql, tell); };
  end.rows = connection.chunks(first_results(study.name, settings.rows), tell);
  end.exit_code = tell_end(console, end.status, query);
  return end;
}

}  // namespace

void check_settings(const RunSettings& settings) {
  constexpr int kMostWorkers = 1024;
  if (settings.service.workers < 1 || settings.service.workers > kMostWorkers) {
    throw solver::InputError(fmt::format("--workers {} is not allowed: it must be from 1 to {}",
                                         settings.service.workers, kMostWorkers));
  }
  if (settings.rows < 0) {
    throw solver::InputError(
        fmt::format("--limit {} is not allowed: it must be >= 0", settings.rows));
  }
}

void add_worker_flags(CLI::App& verb, RunSettings& settings) {
  verb.add_option("--workers", settings.service.workers,
                  "worker processes, which share the cores of this machine")
      ->type_name("N")
      ->capture_default_str();
  verb.add_option(
          "--fall-memory", settings.service.fall_memory_bytes,
          "memory of all workers for solved falls, as 2GB; the default is an eighth of what "
          "is free")
      ->type_name("SIZE")
      ->transform(CLI::AsSizeValue(false).description(""));
  verb.add_flag("--verbose", settings.service.verbose, "show what server and workers say");
}

std::optional<RunEnd> run_study(Console& console, const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop) {
  check_settings(settings);
  try {
    ServiceSettings how = settings.service;
    how.only_study = study.name;
    EmbeddedService service(how, stop);
    auto end = submit_and_wait(console, study, settings, service, stop);
    service.stop();
    tell_of_log(console, settings.service.database);
    return end;
  } catch (const Interrupted&) {
    tell_how_to_continue(console, study, settings);
    return std::nullopt;
  }
}

}  // namespace oblique::client
