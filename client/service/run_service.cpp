#include "client/service/run_service.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/mesh_note.h"
#include "client/service/connection.h"
#include "client/service/watching.h"
#include "proto/study_counts.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/version.h"

namespace oblique::client {
namespace {

/// Why the workers of this run do not solve the rest of a study, and what to do; or empty.
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
      status.name(), status.solver_version(), own, shown_count(protocol::open_points(status)));
}

/// Names the other studies of the database that are not finished. They wait during this run.
void tell_of_other_studies(Connection& connection, const Study& study,
                           const std::filesystem::path& database) {
  std::vector<std::string> others;
  for (const auto& other : connection.status({}, {})) {
    if (other.name() != study.name && other.state() == "running") {
      others.push_back(fmt::format("{} ({} points open)", other.name(),
                                   shown_count(protocol::open_points(other))));
    }
  }
  if (!others.empty()) {
    constexpr std::size_t kMostNamed = 3;
    const std::size_t more = others.size() - std::min(others.size(), kMostNamed);
    others.resize(others.size() - more);
    tell_line(fmt::format(
        "Also unfinished in {0}: {1}{2}. To go on with one, repeat the `oblique run` that "
        "began it; `oblique view {0}` goes on with all.",
        database.string(), fmt::join(others, ", "),
        more > 0 ? fmt::format(" and {} more", shown_count(more)) : ""));
  }
}

RunEnd submit_and_wait(const Study& study, const RunSettings& settings, EmbeddedService& service,
                       protocol::StopSignals& stop) {
  const auto keep_waiting = [&] {
    service.check();
    if (const auto news = service.news(); !news.empty()) {
      std::cerr << protocol::visible_lines(news) << '\n';
    }
    return !stop.requested();
  };
  ConnectionSettings where;
  where.server_url = service.client_url();
  where.key = service.client_key();
  where.if_silent = why_silent(settings.service.database);
  Connection connection(where, keep_waiting);
  const auto submitted = connection.submit(study, {.no_reuse = settings.no_reuse});
  if (submitted.created()) {
    tell_mesh(std::cerr, study.recipe);
  } else {
    std::cerr << fmt::format("Going on with \"{}\": {} of {} points are done.\n", study.name,
                             shown_count(submitted.settled()), shown_count(submitted.points()));
  }
  if (const std::string taken = taken_over(submitted.taken()); !taken.empty()) {
    std::cerr << fmt::format("\"{}\": {}\n", study.name, taken);
  }
  tell_of_other_studies(connection, study, settings.service.database);
  const auto ask = [&](const Tell& tell) {
    keep_waiting();
    auto status = study_named(connection, study.name, tell);
    if (const auto reason = objection_to_waiting(status); !reason.empty()) {
      throw std::runtime_error(reason);
    }
    return status;
  };
  RunEnd end;
  end.status = watch_study(ask, stop);
  if (stop.requested()) {
    throw Interrupted("stopped");
  }
  const auto query = [&](const std::string& sql) { return connection.query(sql, tell_line); };
  end.rows = connection.chunks(first_results(study.name, settings.rows), tell_line);
  end.exit_code = tell_end(end.status, query);
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
        fmt::format("--rows {} is not allowed: it must be >= 0", settings.rows));
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

std::optional<RunEnd> run_study(const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop) {
  check_settings(settings);
  try {
    ServiceSettings how = settings.service;
    how.only_study = study.name;
    EmbeddedService service(how, stop);
    auto end = submit_and_wait(study, settings, service, stop);
    service.stop();
    return end;
  } catch (const Interrupted&) {
    std::cerr << fmt::format(
        "Stopped. What was solved of \"{}\" is in {}; the same command again goes on from there.\n",
        study.name, settings.service.database.string());
    return std::nullopt;
  }
}

}  // namespace oblique::client
