#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "client/python/interpreter.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::python {
namespace {

namespace py = pybind11;
using protocol::CellKind;
using protocol::Value;

struct Column {
  std::string name;
  std::string unit;  ///< SI unit; empty for pure numbers and texts
  std::vector<Value> values;

  template <class Kind>
  bool has() const {
    return std::any_of(values.begin(), values.end(),
                       [](const Value& value) { return std::holds_alternative<Kind>(value); });
  }
};

std::vector<Column> answer_to(server::Reader& reader, const protocol::QueryRequest& request) {
  std::vector<Column> columns;
  server::Answer answer = reader.answer(request, {UINT64_MAX, 0});
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = answer.next();
    for (int i = static_cast<int>(columns.size()); i < chunk.columns_size(); ++i) {
      columns.push_back({chunk.columns(i), i < chunk.units_size() ? chunk.units(i) : "", {}});
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        columns[i].values.push_back(protocol::value_of(rows.cell(i)));
      }
    }
    ends = chunk.ends();
  }
  return columns;
}

/// Returns an int64 array if all values are integers, a list if some are texts, else a float64
/// array with NaN for NULL.
py::object values_of(const Column& column) {
  const auto kind = server::kind_of_values(column.name);
  const bool has_real = column.has<double>();
  const bool has_number = has_real || column.has<std::int64_t>();
  if (column.has<std::string>() || (!has_number && kind == CellKind::kText)) {
    return py::cast(column.values);
  }
  std::vector<std::int64_t> integers;
  std::vector<double> reals;
  const bool are_integers = !has_real && !column.has<std::monostate>() && kind != CellKind::kReal;
  for (const Value& value : column.values) {
    const auto* integer = std::get_if<std::int64_t>(&value);
    const auto* real = std::get_if<double>(&value);
    if (are_integers) {
      integers.push_back(*integer);
    } else {
      reals.push_back(real      ? *real
                      : integer ? static_cast<double>(*integer)
                                : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return are_integers ? py::object(array_of(std::move(integers)))
                      : py::object(array_of(std::move(reals)));
}

/// A database file. Each call opens the file, so calls from several threads share nothing.
class Database {
 public:
  explicit Database(const std::string& file) : file_(std::filesystem::absolute(file).string()) {
    refuse_forked_child();
    if (!std::filesystem::exists(file_)) {
      throw std::filesystem::filesystem_error(
          "", file_, std::make_error_code(std::errc::no_such_file_or_directory));
    }
    const server::Reader reader(file_);  // throws if the file is not a database of oblique
  }

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

  /// Returns a dict for each study.
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
    const auto reader = std::make_shared<server::Reader>(file_);
    return interruptibly<Result>([reader, read](const std::atomic<bool>&) { return read(*reader); },
                                 [reader] { reader->interrupt(); });
  }

  /// Runs a query; returns (name, unit, values) of each column.
  py::list ask(const protocol::QueryRequest& request) {
    const auto columns = with_reader<std::vector<Column>>(
        [request](server::Reader& reader) { return answer_to(reader, request); });
    py::list all;
    for (const Column& column : columns) {
      all.append(py::make_tuple(column.name, column.unit, values_of(column)));
    }
    return all;
  }

  const std::string file_;
};

}  // namespace

void add_database(py::module_& module) {
  py::class_<Database>(module, "Database")
      .def(py::init<const std::string&>(), py::arg("file"))
      .def("query", &Database::query)
      .def("sql", &Database::sql)
      .def("studies", &Database::studies);
}

}  // namespace oblique::python
