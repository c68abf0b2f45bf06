#include "client/python/database.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "client/python/conversions.h"
#include "client/python/interruptible.h"
#include "client/python/query_columns.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::python {
namespace {

namespace py = pybind11;
using protocol::CellKind;

/// A database file that several threads of one process may ask, one after another.
class SharedReader {
 public:
  explicit SharedReader(const std::string& file) : file_(std::filesystem::absolute(file).string()) {
    if (!std::filesystem::exists(file_)) {
      throw std::filesystem::filesystem_error(
          "", file_, std::make_error_code(std::errc::no_such_file_or_directory));
    }
    open();
  }

  /// As an absolute path.
  const std::string& file() const { return file_; }
  bool is_of_this_process() const { return process_ == getpid(); }

  /// Lets `ask` have the reader, unless `stop` was set before its turn.
  template <class Ask>
  auto with_reader(const std::atomic<bool>& stop, const Ask& ask) {
    const std::lock_guard lock(mutex_);
    if (is_interrupted_) {  // for good
      open();
    }
    const struct Asking {
      SharedReader& shared;
      Asking(SharedReader& all, const std::atomic<bool>& stop) : shared(all) {
        shared.set_asking(&stop);
      }
      ~Asking() { shared.set_asking(nullptr); }
    } asking(*this, stop);
    if (stop) {
      throw Stopped();
    }
    return ask(*reader_);
  }

  /// What there is to say of how it is read; mostly nothing.
  const std::string& remark() const { return reader_->remark(); }

  /// Ends what was asked with `stop`, with an error.
  void interrupt(const std::atomic<bool>& stop) {
    const std::lock_guard lock(asking_mutex_);
    if (asking_ == &stop) {
      is_interrupted_ = true;
      reader_->interrupt();
    }
  }

 private:
  void set_asking(const std::atomic<bool>* stop) {
    const std::lock_guard lock(asking_mutex_);
    asking_ = stop;
  }

  void open() {
    reader_ = std::make_unique<server::Reader>(file_);
    is_interrupted_ = false;
  }

  const std::string file_;
  std::mutex mutex_;
  std::unique_ptr<server::Reader> reader_;
  const pid_t process_ = getpid();
  bool is_interrupted_ = false;
  std::mutex asking_mutex_;
  const std::atomic<bool>* asking_ = nullptr;  ///< who has the reader
};

/// Throws InputError for a study that there is not, with the nearest.
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

QueryColumns answer_to(SharedReader& shared, const protocol::QueryRequest& request,
                       const std::atomic<bool>& stop) {
  return shared.with_reader(stop, [&](server::Reader& reader) {
    QueryColumns columns;
    server::Answer answer = begun(reader, request);
    for (bool ends = false; !ends;) {
      const protocol::QueryReply chunk = answer.next();
      columns.add(chunk);
      ends = chunk.ends();
    }
    return columns;
  });
}

py::object object_of(const AnswerColumn& column, std::size_t row) {
  switch (static_cast<CellKind>(column.kinds[row])) {
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

/// Whole numbers that are all there are int64, other numbers float64 with NaN where there is none,
/// and all else a list.
py::object values_of(AnswerColumn&& column) {
  const auto kind = server::kind_of_values(column.name);
  const bool has_number = std::any_of(column.kinds.begin(), column.kinds.end(), [](char each) {
    return static_cast<CellKind>(each) != CellKind::kNull;
  });
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

class Database {
 public:
  explicit Database(const std::string& file) : shared_(std::make_shared<SharedReader>(file)) {}

  std::string remark() { return shared()->remark(); }

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
    using Studies = std::vector<protocol::StudyStatus>;
    const auto found = interruptibly<Studies>([shared = shared()](const std::atomic<bool>& stop) {
      return shared->with_reader(stop,
                                 [](server::Reader& reader) { return reader.study_status(); });
    });
    py::list all;
    for (const protocol::StudyStatus& study : found) {
      py::dict named;
      named["study_id"] = study.study_id();
      named["name"] = study.name();
      named["state"] = study.state();
      named["points"] = study.points();
      named["solved"] = study.solved();
      named["failed"] = study.failed();
      named["left_out"] = study.left_out();
      named["created_at"] = study.created_at();
      named["solver_version"] = study.solver_version();
      all.append(named);
    }
    return all;
  }

 private:
  /// The reader of this process. That of the parent is left alone behind a fork: SQLite's files may
  /// not be carried over, and threads that are not here may have locked it.
  const std::shared_ptr<SharedReader>& shared() {
    if (!shared_->is_of_this_process()) {
      auto own = std::make_shared<SharedReader>(shared_->file());
      static_cast<void>(new std::shared_ptr(std::exchange(shared_, std::move(own))));
    }
    return shared_;
  }

  /// (name, unit, values) of each column.
  py::list ask(const protocol::QueryRequest& request) {
    auto answer = interruptibly<QueryColumns>(
        [shared = shared(), request](const std::atomic<bool>& stop) {
          return answer_to(*shared, request, stop);
        },
        [shared = shared()](const std::atomic<bool>& stop) { shared->interrupt(stop); });
    py::list all;
    for (AnswerColumn& column : answer.columns()) {
      all.append(py::make_tuple(column.name, column.unit, values_of(std::move(column))));
    }
    return all;
  }

  std::shared_ptr<SharedReader> shared_;
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
