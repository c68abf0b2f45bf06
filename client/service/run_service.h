#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/embedded_service.h"
#include "client/service/source.h"
#include "client/study/study.h"
#include "proto/oblique.pb.h"
#include "proto/program/process.h"

namespace oblique::client {

/// How `run` runs a study, and `paper` its cases.
struct RunSettings {
  ServiceSettings service{.database = DatabaseSettings().file};
  bool no_reuse = false;   ///< as in SubmitSettings
  std::int64_t rows = 30;  ///< most rows of results asked for at the end
};

/// Adds --workers and --verbose. `settings` must live as long as `verb`.
void add_worker_flags(CLI::App& verb, RunSettings& settings);

/// Throws solver::InputError, naming the flag and what is allowed, for a number of workers or rows
/// that cannot be.
void check_settings(const RunSettings& settings);

/// How a study ended.
struct RunEnd {
  protocol::StudyStatus status;
  std::vector<protocol::QueryReply> rows;  ///< chunks of the first results
  int exit_code;                           ///< kDone when every point is solved
};

/// Starts server and workers here, submits the study, shows its progress and waits for its end;
/// nothing is left running. Nothing when `stop` is requested; what to do next is told then. Throws
/// ProcessError when server or workers end too soon, ServerError when the study is refused.
std::optional<RunEnd> run_study(Console& console, const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop);

}  // namespace oblique::client
