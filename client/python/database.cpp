#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "client/python/calls.h"
#include "client/python/results.h"
#include "proto/oblique.pb.h"
#include "proto/wire/cell.h"
#include "proto/wire/chunk_rows.h"
#include "server/query/columns.h"
#include "server/query/query_rules.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::python {
namespace {

namespace py = pybind11;
using protocol::CellKind;

/// One column of an answer. Numbers are in `reals`, and whole ones also in `integers`.
struct Column {
  std::string name;
  std::string unit;  ///< SI; empty for pure numbers and texts
  bool has_text = false;
  bool has_real = false;
  bool has_null = false;
  bool has_integer = false;
  std::vector<CellKind> kinds;
  std::vector<std::int64_t> integers;
  std::vector<double> reals;       ///< NaN for what is no number
  std::vector<std::string> texts;  ///< as long as the others once there is a text
};

void add_cell(Column& column, const protocol::Cell& cell) {
  const bool is_text = cell.kind == CellKind::kText;
  const bool is_integer = cell.kind == CellKind::kInteger;
  const bool is_real = cell.kind == CellKind::kReal;
  if (is_text && !column.has_text) {
    column.texts.resize(column.kinds.size());
  }
  column.has_text = column.has_text || is_text;
  column.has_real = column.has_real || is_real;
  column.has_integer = column.has_integer || is_integer;
  column.has_null = column.has_null || cell.kind == CellKind::kNull;
  column.kinds.push_back(cell.kind);
  column.integers.push_back(is_integer ? cell.integer : 0);
  column.reals.push_back(is_real      ? cell.real
                         : is_integer ? static_cast<double>(cell.integer)
                                      : std::numeric_limits<double>::quiet_NaN());
  if (column.has_text) {
    column.texts.emplace_back(is_text ? cell.text : std::string_view());
  }
}

/// Throws InputError for a study that does not exist, with the nearest name.
server::Answer begun(server::Reader& reader, const protocol::QueryRequest& request) {
  try {
    return reader.answer(request, server::kNoLimits);
  } catch (const solver::InputError&) {
    try {
      static_cast<void>(reader.study_status(request.question().study()));
    } catch (const server::QueryError& error) {
      throw solver::InputError(error.what());
    }
    throw;
  }
}

std::vector<Column> answer_to(server::Reader& reader, const protocol::QueryRequest& request) {
  std::vector<Column> columns;
  server::Answer answer = begun(reader, request);
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = answer.next();
    for (int i = static_cast<int>(columns.size()); i < chunk.columns_size(); ++i) {
      Column& column = columns.emplace_back();
      column.name = chunk.columns(i);
      column.unit = i < chunk.units_size() ? chunk.units(i) : "";
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        add_cell(columns[i], rows.cell(i));
      }
    }
    ends = chunk.ends();
  }
  return columns;
}

py::object object_of(const Column& column, std::size_t row) {
  switch (column.kinds[row]) {
    case CellKind::kInteger:
      return py::int_(column.integers[row]);
    case CellKind::kReal:
      return py::float_(column.reals[row]);
    case CellKind::kText:
      return py::str(column.texts[row]);
    default:
      return py::none();
  }
}

/// int64 where all values are whole numbers, else float64 with NaN for NULL; a list where some are
/// texts.
py::object values_of(Column&& column) {
  const auto kind = server::kind_of_values(column.name);
  const bool has_number = column.has_integer || column.has_real;
  if (column.has_text || (!has_number && kind == CellKind::kText)) {
    py::list values(column.kinds.size());
    for (std::size_t i = 0; i < column.kinds.size(); ++i) {
      values[i] = object_of(column, i);
    }
    return values;
  }
  const bool is_real = column.has_real || column.has_null || kind == CellKind::kReal;
  return is_real ? py::object(array_of(std::move(column.reals)))
                 : py::object(array_of(std::move(column.integers)));
}

/// A database file. Every call opens it anew, so that calls of several threads share nothing.
class Database {
 public:
  explicit Database(const std::string& file) : file_(std::filesystem::absolute(file).string()) {
    refuse_forked_child();
    if (!std::filesystem::exists(file_)) {
      throw std::filesystem::filesystem_error(
          "", file_, std::make_error_code(std::errc::no_such_file_or_directory));
    }
    remark_ = server::Reader(file_).remark();
  }

  /// Says how the database is read, if that is unusual; else empty.
  const std::string& remark() const { return remark_; }

  py::list query(const std::string& study, const std::string& where, const std::string& select,
                 const std::string& group, const std::string& order,
                 std::optional<std::uint64_t> limit) {
    protocol::QueryRequest request;
    protocol::StudyQuery& question = *request.mutable_question();
    question.set_study(study);
    question.set_where(where);
    if (!select.empty()) {
      question.add_select(select);
    }
    question.set_group(group);
    question.set_order(order);
    if (limit) {
      question.set_limit(*limit);
    }
    return ask(request);
  }

  py::list sql(const std::string& statement) {
    protocol::QueryRequest request;
    request.set_sql(statement);
    return ask(request);
  }

  /// A dict for each study.
  py::list studies() {
    const auto found = with_reader<std::vector<protocol::StudyStatus>>(
        [](server::Reader& reader) { return reader.study_status(); });
    py::list all;
    for (const protocol::StudyStatus& study : found) {
      using namespace py::literals;
      all.append(py::dict("study_id"_a = study.study_id(), "name"_a = study.name(),
                          "state"_a = study.state(), "points"_a = study.points(),
                          "solved"_a = study.solved(), "failed"_a = study.failed(),
                          "left_out"_a = study.left_out(), "created_at"_a = study.created_at(),
                          "solver_version"_a = study.solver_version()));
    }
    return all;
  }

 private:
  template <class Result>
  Result with_reader(const std::function<Result(server::Reader&)>& read) {
    refuse_forked_child();
    const auto reader = std::make_shared<server::Reader>(file_);
    return interruptibly<Result>([reader, read](const std::atomic<bool>&) { return read(*reader); },
                                 [reader] { reader->interrupt(); });
  }

  /// (name, unit, values) of each column.
  py::list ask(const protocol::QueryRequest& request) {
    auto columns = with_reader<std::vector<Column>>(
        [request](server::Reader& reader) { return answer_to(reader, request); });
    py::list all;
    for (Column& column : columns) {
      all.append(py::make_tuple(column.name, column.unit, values_of(std::move(column))));
    }
    return all;
  }

  const std::string file_;
  std::string remark_;
};

}  // namespace

void add_database(py::module_& module) {
  py::class_<Database>(module, "Database")
      .def(py::init<const std::string&>(), py::arg("file"))
      .def("remark", &Database::remark)
      .def("query", &Database::query)
      .def("sql", &Database::sql)
      .def("studies", &Database::studies);
}

}  // namespace oblique::python
