#include "client/trace/solve_again.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <iterator>
#include <map>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/case_report.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "server/maintenance/study_changes_offline.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "worker/solver/estimate.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using nlohmann::json;
using protocol::Value;

solver::CaseResult solve_with_status(Console& console, const solver::Finger& finger,
                                     const PointToSolve& point, const solver::Tracing& tracing,
                                     bool shows_status) {
  StatusLine line(console, {.is_shown = shows_status});
  static_cast<void>(largest_drop_m(finger, line));
  const auto contact =
      line.begin(fmt::format("on {} elements a link: contact", finger.model().elements_per_link));
  return finger.solve(point.H_m, point.mu, point.e_star, tracing);
}

/// Returns the estimated errors. Returns none and prints a note if there is no coarser mesh, or if
/// the point cannot be solved on the coarser mesh.
solver::ErrorEstimate estimate_errors(Console& console, const solver::ModelParameters& model,
                                      const PointToSolve& point, const solver::CaseResult& result,
                                      bool shows_status) {
  const solver::ModelParameters coarse = solver::companion_model(model);
  if (coarse.elements_per_link >= model.elements_per_link) {
    console.note("Errors cannot be estimated: no mesh is coarser than one element a link.");
    return {};
  }
  try {
    return solver::estimated_errors(
        model, result, solve_with_status(console, solver::Finger(coarse), point, {}, shows_status));
  } catch (const std::exception& error) {
    console.note(fmt::format("Errors cannot be estimated: on half the mesh, {}", error.what()));
    return {};
  }
}

[[noreturn]] void throw_unsolved(const std::string& study, std::uint64_t point,
                                 const std::string& reason) {
  throw std::runtime_error(fmt::format("point {} of {} has no answer: {}", point, study, reason));
}

/// Forwards the fall, every K-th instant of the contact, all ends of phases and the last instant.
class EveryKth {
 public:
  EveryKth(std::uint64_t every, const solver::Tracing::Sink& row) : every_(every), row_(row) {}

  void add(const solver::TraceRow& row) {
    const bool is_instant = row.state != solver::kFalling;
    last_.reset();
    if (!is_instant || every_ < 2 || instants_ % every_ == 0 ||
        solver::ends_phase(state_before_, row.state)) {
      row_(row);
    } else {
      last_ = row;
    }
    instants_ += is_instant ? 1U : 0U;
    state_before_ = row.state;
  }
  void finish() {
    if (last_) {
      row_(*last_);
    }
  }

 private:
  std::uint64_t every_;
  const solver::Tracing::Sink& row_;
  std::optional<solver::TraceRow> last_;  // last instant, if it was skipped
  std::string state_before_;
  std::uint64_t instants_ = 0;
};

SolvedAgain solve_in_this_process(Console& console, const PointSpec& point,
                                  const TraceOptions& options,
                                  const std::function<void(const solver::TraceShape&)>& begin,
                                  const solver::Tracing::Sink& row, bool shows_status) {
  const solver::Finger finger(point.model);
  begin(solver::trace_shape(point.model.lengths_m.size(),
                            static_cast<std::size_t>(point.model.elements_per_link),
                            options.with_shape));
  EveryKth rows(options.every, row);
  const solver::Tracing tracing{[&rows](const solver::TraceRow& each) { rows.add(each); },
                                options.with_shape, options.with_fall};
  try {
    const auto result = solve_here(console, finger, point, tracing, shows_status);
    rows.finish();
    return {.point = point, .result = result, .solver = "here"};
  } catch (const solver::SolveError& error) {
    throw_unsolved(point.study, point.point, error.what());
    // The study was accepted with this value, so the error is not wrong usage.
  } catch (const solver::InputError& error) {
    throw_unsolved(point.study, point.point, error.what());
  }
}

PointSpec point_of(const std::string& study, std::uint64_t point,
                   const protocol::TraceReply& reply) {
  return {{reply.h_m(), reply.mu(), reply.e_star(), reply.errors()},
          study,
          point,
          protocol::from_message(reply.model())};
}

/// Reads the point from a database file: from its row or, if it is not solved, from the recipe.
/// Throws as server::stored_recipe and protocol::point_reply do.
PointSpec point_in(const std::string& database, const protocol::StudyStatus& study,
                   std::uint64_t point, const protocol::Table& row) {
  auto reply = protocol::point_reply(
      protocol::PointTable(server::stored_recipe(database, study.study_id())), point);
  server::use_stored_inputs(row, reply);
  return point_of(study.name(), point, reply);
}

/// Throws ConnectionError for an invalid trace, and ServerError for a trace that is too long.
void check_trace(const Connection& connection, const protocol::Trace& trace,
                 const solver::TraceShape& shape, bool with_fall) {
  if (const std::string fault = protocol::fault_of_trace(trace, shape, with_fall); !fault.empty()) {
    throw ConnectionError(
        fmt::format("the trace from {} is invalid: {}; --local solves the point in this process",
                    connection.url(), fault));
  }
  if (trace.states().empty()) {
    const std::string every =
        trace.every() > trace.instants()
            ? std::string()
            : fmt::format("--every {} writes one in {} and all ends of phases, ", trace.every(),
                          trace.every());
    throw ServerError(
        fmt::format("the trace has {} instants, too many for one message: {}--local solves the "
                    "point in this process and writes all",
                    trace.instants(), every));
  }
}

SolvedAgain solve_by_worker(Console& console, Connection& connection, const std::string& study,
                            std::uint64_t point, const TraceOptions& options,
                            const std::function<void(const solver::TraceShape&)>& begin,
                            const solver::Tracing::Sink& row, bool shows_status) {
  StatusLine line(console, {.is_shown = shows_status});
  const auto waiting = line.begin(
      fmt::format("a worker of {} is solving point {} of {}", connection.url(), point, study));
  protocol::TraceRequest request;
  request.set_study(study);
  request.set_point(point);
  request.set_shape(options.with_shape);
  request.set_fall(options.with_fall);
  request.set_every(options.every);
  request.set_time_limit_ms(static_cast<std::uint64_t>(options.time_limit_ms));
  const protocol::TraceReply reply = connection.trace(request);
  const protocol::Trace& trace = reply.trace();
  if (!trace.result().error().empty()) {
    throw_unsolved(study, point, trace.result().error());
  }
  SolvedAgain solved{
      .point = point_of(study, point, reply),
      .solver = fmt::format("by worker {} ({})", reply.worker(), reply.instruction_set()),
      .every = trace.every()};
  const PointSpec& spec = solved.point;
  if (reply.outputs() == protocol::sent_outputs()) {
    auto& result = solved.result.emplace(protocol::from_message(trace.result()));
    result.H_m = spec.H_m;
    result.mu = spec.mu;
    result.e_star = spec.e_star;
    result.solver.integrator = solver::integrator_name(spec.model.integrator);
    result.solver.version = reply.solver_version();
  }
  const auto shape = solver::trace_shape(spec.model.lengths_m.size(),
                                         static_cast<std::size_t>(spec.model.elements_per_link),
                                         options.with_shape);
  check_trace(connection, trace, shape, options.with_fall);
  begin(shape);
  const std::size_t numbers = solver::trace_numbers(shape);
  for (std::size_t i = 0; i < trace.states().size(); ++i) {
    row(solver::trace_row(shape, {trace.values().data() + i * numbers, numbers},
                          solver::kTraceStates.at(static_cast<unsigned char>(trace.states()[i]))));
  }
  return solved;
}

/// The row of a point in the view `runs`, by column; empty if the point is not solved.
using StoredRow = std::map<std::string, Value>;

StoredRow by_column(const protocol::Table& table) {
  StoredRow row;
  for (std::size_t i = 0; !table.rows.empty() && i < table.columns.size(); ++i) {
    row.emplace(table.columns[i], table.rows[0].at(i));
  }
  return row;
}

/// Returns the text of a column; empty if it is NULL or missing.
std::string text_in(const StoredRow& row, const std::string& column) {
  const auto found = row.find(column);
  const auto* text = found == row.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string() : *text;
}

/// Whether a stored value equals a computed one. Numbers in stored lists have only 8 digits.
bool is_kept_as(const json& stored, const solver::Cell& cell) {
  constexpr double kHalfOfTheLastDigit = 5.1e-8;
  if (const auto* text = std::get_if<std::string_view>(&cell)) {
    return stored == *text;
  }
  const bool* const flag = std::get_if<bool>(&cell);
  const double value = flag != nullptr ? static_cast<double>(*flag) : std::get<double>(cell);
  return stored.is_number() &&
         std::abs(stored.get<double>() - value) <= kHalfOfTheLastDigit * std::abs(value);
}

bool is_same_list(const Value& stored, const solver::ResultList& list,
                  const solver::CaseResult& result) {
  // A list without elements may be NULL.
  const auto* text = std::get_if<std::string>(&stored);
  const json elements = text != nullptr ? json::parse(*text, nullptr, false) : json::array();
  if (!elements.is_array()) {
    return false;
  }
  std::size_t elements_seen = 0;
  bool is_same = true;
  list.each(result, [&](std::span<const solver::Cell> element) {
    const json kept = elements_seen < elements.size() ? elements[elements_seen] : json();
    is_same = is_same && kept.is_array() &&
              std::equal(kept.begin(), kept.end(), element.begin(), element.end(), is_kept_as);
    ++elements_seen;
  });
  return is_same && elements_seen == elements.size();
}

template <class T>
void compare_scalars(const StoredRow& stored, const solver::CaseResult& result,
                     std::vector<std::string>& differing) {
  solver::for_each_sent<T>([&](const solver::ResultField& field, const solver::Member<T>& member) {
    const auto before = stored.find(std::string(field.column));
    const T* now = member.of(result);
    if (field.name != "wall_s" && before != stored.end() &&
        before->second != (now == nullptr ? Value() : Value(*now))) {
      differing.emplace_back(field.column);
    }
  });
}

/// Returns the outputs in which the stored row differs from `result`, as "fn_peak_N, mode (stored
/// by solver 0.1, now solved by 0.2)"; empty if there are none. Compares all bits of scalars and 8
/// digits of numbers in lists; ignores `wall_s`.
std::string differences_in_words(const StoredRow& stored, const solver::CaseResult& result) {
  std::vector<std::string> columns;
  compare_scalars<double>(stored, result, columns);
  compare_scalars<std::int64_t>(stored, result, columns);
  compare_scalars<std::string>(stored, result, columns);
  for (const solver::ResultList* list : solver::result_lists()) {
    const auto before = stored.find(std::string(list->column));
    if (before != stored.end() && !is_same_list(before->second, *list, result)) {
      columns.emplace_back(list->column);
    }
  }
  if (columns.empty()) {
    return {};
  }
  const std::string before = text_in(stored, "solver_version");
  const std::string& now = result.solver.version;
  return fmt::format("{} ({})", fmt::join(columns, ", "),
                     before == now
                         ? fmt::format("both by solver {}", now)
                         : fmt::format("stored by solver {}, now solved by {}", before, now));
}

void compare(const StoredRow& stored, SolvedAgain& solved) {
  if (stored.empty()) {
    solved.comparison = "not stored yet";
    return;
  }
  const auto differing = solved.result ? differences_in_words(stored, *solved.result) : "";
  solved.is_confirmed = solved.result && differing.empty();
  solved.comparison =
      solved.is_confirmed ? "same as stored"
      : solved.result     ? "differs from the stored row in " + differing
                      : "not compared with the stored row, because the worker sent unknown outputs";
}

}  // namespace

ReachCheck tip_reach(Console& console) {
  return ReachChecker([&console](const solver::ModelParameters& model) {
    const solver::Finger finger(model);
    StatusLine line(console);
    return largest_drop_m(finger, line);
  });
}

double largest_drop_m(const solver::Finger& finger, StatusLine& line) {
  const auto falling = line.begin([&finger] {
    const auto& model = finger.model();
    double length_m = 0.0;  // the tip turns back when the drop is about the length of the chain
    for (const double each_m : model.lengths_m) {
      length_m += each_m;
    }
    return fmt::format("on {} elements a link: fall {} of {} m", model.elements_per_link,
                       solver::readable_number(finger.drop_so_far_m(), 3),
                       solver::readable_number(length_m, 3));
  });
  return finger.largest_drop_m();
}

solver::CaseResult solve_here(Console& console, const solver::Finger& finger,
                              const PointToSolve& point, const solver::Tracing& tracing,
                              bool shows_status) {
  auto result = solve_with_status(console, finger, point, tracing, shows_status);
  if (point.errors) {
    result.errors = estimate_errors(console, finger.model(), point, result, shows_status);
  }
  return result;
}

void add_point_source(CLI::App& command, PointSource& flags) {
  auto* local = command.add_flag("--local", flags.is_local, "solve the point in this process");
  command.add_flag("--on-worker", flags.is_on_worker, "let a worker of the server solve the point")
      ->excludes(local);
  add_source_flags(command, flags.source);
}

SolvedAgain solve_again(Console& console, const PointSource& from, const std::string& study,
                        std::uint64_t point, const TraceOptions& options,
                        const std::function<void(const solver::TraceShape&)>& begin,
                        const solver::Tracing::Sink& row, bool shows_status) {
  const std::string database = database_meant(from.source);
  if (!database.empty() && from.is_on_worker) {
    throw solver::InputError(
        "--on-worker needs a server, but a database file is read here: name a server with --server "
        "URL");
  }
  const auto source = open_source(console, from.source);
  const auto table = source->query(fmt::format("SELECT * FROM runs WHERE study = {} AND point = {}",
                                               server::sql_text(study), point));
  std::optional<Connection> connection;
  std::optional<PointSpec> local;
  if (!database.empty()) {
    local = point_in(database, study_named(*source, study), point, table);
  } else {
    connection.emplace(connection_settings(console, from.source));
    if (from.is_local) {
      protocol::TraceRequest request;
      request.set_study(study);
      request.set_point(point);
      request.set_only_point(true);
      local = point_of(study, point, connection->trace(std::move(request)));
    }
  }
  const auto stored = by_column(table);
  if (text_in(stored, "status") == "failed") {  // solving the point here may crash this process
    throw std::runtime_error(
        fmt::format("point {} of {} failed and has no trace: {}. `oblique retry {}` solves it "
                    "again; `oblique solve --trace` with its values shows where it fails",
                    point, study, text_in(stored, "error"), study));
  }
  TraceOptions limited = options;
  if (connection && from.source.timeout_s) {
    limited.time_limit_ms = connection_settings(console, from.source).timeout_ms;
  }
  auto solved = local ? solve_in_this_process(console, *local, options, begin, row, shows_status)
                      : solve_by_worker(console, *connection, study, point, limited, begin, row,
                                        shows_status);
  compare(stored, solved);
  return solved;
}

std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows) {
  const auto touch = std::find_if(rows.begin(), rows.end(), [](const solver::TraceRow& row) {
    return row.state != solver::kFalling;
  });
  std::vector<solver::TraceRow> fall(std::make_move_iterator(rows.begin()),
                                     std::make_move_iterator(touch));
  rows.erase(rows.begin(), touch);
  return fall;
}

namespace {

/// Appends one instant as a line of CSV.
void append_csv_row(std::string& text, const solver::TraceRow& row) {
  std::string_view separator;
  const auto put = [&](double value) {
    text.append(separator);
    append_number(text, value);
    separator = ",";
  };
  for (const auto& column : solver::trace_columns()) {
    if (const auto* number = std::get_if<double solver::TraceRow::*>(&column.value)) {
      put(row.*(*number));
    } else if (const auto* vectors = std::get_if<solver::TraceVectors>(&column.value)) {
      for (const double value : row.*(vectors->values)) {
        put(value);
      }
    } else {
      text.append(separator).append(row.*std::get<std::string solver::TraceRow::*>(column.value));
    }
  }
  text += '\n';
}

}  // namespace

TraceOutput::TraceOutput(const std::string& file, Format format, std::string_view flag)
    : format_(format), fills_terminal_(file.empty() && isatty(STDOUT_FILENO) == 1) {
  if (file.empty()) {
    sink_ = std::make_unique<StandardOutput>();
  } else {
    sink_ = std::make_unique<AtomicFile>(file, flag);
  }
}

void TraceOutput::begin(const solver::TraceShape& shape) {
  shape_ = shape;
  if (format_ == Format::kCsv) {
    text_ += fmt::format("{}\n", fmt::join(solver::trace_headings(shape), ","));
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  constexpr std::size_t kLong = std::size_t{64} << 10U;
  if (format_ == Format::kCsv) {
    append_csv_row(text_, row);
    if (text_.size() >= kLong) {
      sink_->append(std::exchange(text_, {}));
    }
  } else {
    ++rows_;
    solver::append_numbers(row, numbers_);
    states_.push_back(row.state);
  }
}

void TraceOutput::finish(const PointSpec& point, const std::optional<solver::CaseResult>& result) {
  if (format_ == Format::kJson) {
    const std::size_t numbers = solver::trace_numbers(shape_);
    nlohmann::ordered_json columns;
    std::size_t place = 0;
    for (const auto& heading : solver::trace_headings(shape_)) {
      auto& column = columns[heading] = nlohmann::ordered_json::array();
      if (heading == "state") {
        column = states_;
        continue;
      }
      for (std::size_t i = 0; i < rows_; ++i) {
        column.push_back(numbers_[i * numbers + place]);
      }
      ++place;
    }
    nlohmann::ordered_json all;
    all["study"] = point.study;
    all["point"] = point.point;
    all["result"] = result ? json_of(*result) : nlohmann::ordered_json();
    all["trace"] = std::move(columns);
    text_ = all.dump(-1, ' ', true) + '\n';
  }
  sink_->append(text_);
  sink_->finish();
}

}  // namespace oblique::client
