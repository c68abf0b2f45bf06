#include "client/service/run_service.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>

#include "client/service/connection.h"
#include "client/service/watching.h"
#include "proto/text.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

// The columns that tell the points of this study apart, then the results most asked for.
std::string query_of_results(const Study& study, std::int64_t rows) {
  std::string columns = "point";
  for (const auto& key : solver::model_keys()) {
    const auto varies = [&key](const protocol::Block& block) {
      return std::any_of(block.axes().begin(), block.axes().end(),
                         [&key](const protocol::Axis& axis) { return axis.key() == key.name; });
    };
    const auto& blocks = study.recipe.blocks();
    if (std::any_of(blocks.begin(), blocks.end(), varies)) {
      // SQL does not tell E from e, so the view calls Young's modulus otherwise.
      columns += key.name == "E" ? ", E_Pa" : ", " + std::string(key.name);
    }
  }
  return "SELECT " + columns +
         ", H, mu, e, status, fn_peak_N, ft_peak_N, duration_s, slide_m, stick_total_s, major_mode "
         "FROM runs WHERE study = " +
         sql_text(study.name) + " ORDER BY point LIMIT " + std::to_string(rows);
}

void tell_how_to_continue(const Study& study, const RunSettings& settings) {
  std::cerr << "Stopped. What was solved of \"" << study.name << "\" is in "
            << settings.service.database.string()
            << "; the same command again goes on from there.\n";
}

/// Rows that were not merged into the file are missing in a copy of it.
void tell_of_log(const std::filesystem::path& database) {
  std::error_code ignored;
  const std::string log = database.string() + "-wal";
  const auto size = std::filesystem::file_size(log, ignored);
  if (!ignored && size > 0) {
    std::cerr << "Another program reads " << database.string() << ", so " << log
              << " holds some of its rows: a copy needs both files. `oblique backup COPY.db --db "
              << database.string() << "` makes one that is whole.\n";
  }
}

RunEnd submit_and_wait(const Study& study, const RunSettings& settings, EmbeddedService& service,
                       protocol::StopSignals& stop) {
  const auto look_after = [&] {
    service.check();
    if (const auto news = service.news(); !news.empty()) {
      std::cerr << protocol::visible_lines(news) << '\n';
    }
    return !stop.requested();
  };
  ConnectionSettings where;
  where.server_url = service.client_url();
  Connection connection(where, look_after);
  const auto submitted = connection.submit(study, settings.terms);
  if (!submitted.created()) {
    std::cerr << "Going on with \"" << study.name << "\": " << submitted.settled() << " of "
              << submitted.points() << " points are done.\n";
  }
  const auto ask = [&](const Tell& tell) {
    look_after();
    const auto reply = connection.status(study.name, tell);
    if (reply.studies_size() != 1) {
      throw ServerError("the server no longer knows the study \"" + study.name + "\"");
    }
    return reply.studies(0);
  };
  RunEnd end;
  end.status = watch_study(ask, stop);
  if (stop.requested()) {
    throw Interrupted("stopped");
  }
  const auto query = [&](const std::string& sql) {
    const std::uint64_t servers_limit = 0;
    return connection.query(sql, servers_limit, tell_line);
  };
  end.rows = query(query_of_results(study, settings.rows));
  end.exit_code = tell_end(end.status, query);
  return end;
}

}  // namespace

void check_settings(const RunSettings& settings) {
  constexpr int kMostWorkers = 1024;
  if (settings.service.workers < 1 || settings.service.workers > kMostWorkers) {
    throw solver::InputError("--workers " + std::to_string(settings.service.workers) +
                             " is not allowed: it must be from 1 to " +
                             std::to_string(kMostWorkers));
  }
  if (settings.rows < 0) {
    throw solver::InputError("--rows " + std::to_string(settings.rows) +
                             " is not allowed: it must be >= 0");
  }
}

void add_worker_flags(CLI::App& verb, RunSettings& settings) {
  verb.add_option("--workers", settings.service.workers,
                  "worker processes, which share the cores of this machine")
      ->type_name("N")
      ->capture_default_str();
  verb.add_flag("--verbose", settings.service.verbose, "show what server and workers say");
}

std::optional<RunEnd> run_study(const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop) {
  check_settings(settings);
  try {
    EmbeddedService service(settings.service, stop);
    auto end = submit_and_wait(study, settings, service, stop);
    service.stop();
    tell_of_log(settings.service.database);
    return end;
  } catch (const Interrupted&) {
    tell_how_to_continue(study, settings);
    return std::nullopt;
  }
}

}  // namespace oblique::client
