#include <malloc.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/stl.h>

#include "client/python/calls.h"
#include "client/python/given_points.h"
#include "client/python/results.h"
#include "proto/recipe/blocks.h"
#include "proto/system/available_memory.h"
#include "worker/solver/library/solver.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/model/trace_columns.h"
#include "worker/solver/model/usual_ranges.h"

namespace oblique::python {
namespace {

namespace py = pybind11;

using Falls = std::shared_ptr<FallCache>;

/// A single point with its model.
struct OnePoint {
  ModelParameters model;
  ModelPoint point;
};

OnePoint one_point(const py::dict& keys) {
  GivenPoints given = points_of(keys_of(keys, 1));
  if (!given.faults.front().empty()) {
    throw InputError(given.faults.front());
  }
  return {std::move(given.models.front()), given.points.front()};
}

/// The outputs with H, mu and e of the points.
py::dict with_points(ResultArrays& arrays, const std::vector<ModelPoint>& points) {
  py::dict all = arrays.dict();
  std::vector<double> H_m;
  std::vector<double> mu;
  std::vector<double> e;
  for (const auto& [model, point] : points) {
    H_m.push_back(point.H_m);
    mu.push_back(point.mu);
    e.push_back(point.e_star);
  }
  all["H"] = array_of(std::move(H_m));
  all["mu"] = array_of(std::move(mu));
  all["e"] = array_of(std::move(e));
  return all;
}

py::dict dict_of(const OnePoint& one, const CaseResult& result) {
  ResultArrays arrays(1);
  arrays.set(0, result);
  return with_points(arrays, {one.point});
}

py::dict solve(const Falls& falls, const py::dict& keys, bool errors) {
  const OnePoint one = one_point(keys);
  const auto result = interruptibly<CaseResult>([one, falls, errors](const std::atomic<bool>&) {
    const Finger finger(one.model, falls);
    const Point& point = one.point.point;
    CaseResult solved = finger.solve(point.H_m, point.mu, point.e_star);
    if (errors) {
      solved.errors = errors_by_companion(one.model, solved, *falls);
    }
    return solved;
  });
  return dict_of(one, result);
}

/// Instants of a trace: the numbers of one after those of the other, and the states.
struct Instants {
  CaseResult result;
  std::vector<double> numbers;
  std::vector<std::uint8_t> states;
};

py::tuple trace(const Falls& falls, const py::dict& keys, bool fall, bool shape) {
  const OnePoint one = one_point(keys);
  auto instants = interruptibly<Instants>([one, falls, fall, shape](const std::atomic<bool>& stop) {
    Instants rows;
    Tracing tracing;
    tracing.with_fall = fall;
    tracing.with_shape = shape;
    tracing.sink = [&](const TraceRow& row) {
      if (stop) {
        throw Stopped();
      }
      solver::append_numbers(row, rows.numbers);
      rows.states.push_back(solver::code_of_state(row.state));
    };
    const Point& point = one.point.point;
    rows.result = Finger(one.model, falls).solve(point.H_m, point.mu, point.e_star, tracing);
    return rows;
  });
  const auto headings = solver::trace_headings(solver::trace_shape(
      one.model.lengths_m.size(), static_cast<std::size_t>(one.model.elements_per_link), shape));
  return py::make_tuple(dict_of(one, instants.result), headings,
                        array_of(std::move(instants.numbers)),
                        array_of(std::move(instants.states)));
}

/// Reports to `progress` (or None) and lets signals and what it raises end the work.
std::function<bool(std::size_t)> goes_on(WithoutLock& others_run, std::size_t points,
                                         bool has_signals, const py::object& progress) {
  if (!has_signals && progress.is_none()) {
    return {};
  }
  return [=, &others_run, &progress](std::size_t outcomes) {
    return others_run.with_lock([&] {
      if (has_signals && PyErr_CheckSignals() != 0) {
        throw py::error_already_set();
      }
      if (!progress.is_none()) {
        progress(outcomes, points);
      }
      return true;
    });
  };
}

py::dict solve_many(const Falls& falls, const py::dict& keys, std::size_t count,
                    std::size_t threads, bool errors, const py::object& progress) {
  refuse_forked_child();
  const GivenKeys given_keys = keys_of(keys, count);
  const bool has_signals = is_main_thread();
  ResultArrays arrays(count);
  GivenPoints given;
  {
    WithoutLock others_run;
    given = points_of(given_keys);
    std::vector<ModelPoint> points;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < count; ++i) {
      if (const std::string& fault = given.faults[given.points[i].model]; !fault.empty()) {
        arrays.set_error(i, fault);
      } else {
        points.push_back(given.points[i]);
        places.push_back(i);
      }
    }
    oblique::solve_many(given.models, points,
                        [&](Outcome&& outcome) {
                          const std::size_t place = places[outcome.number];
                          if (outcome.result) {
                            arrays.set(place, *outcome.result);
                          } else {
                            arrays.set_error(place, outcome.error);
                          }
                        },
                        {.threads = threads,
                         .errors = errors,
                         .goes_on = goes_on(others_run, count, has_signals, progress),
                         .falls = falls});
  }
  if (!progress.is_none()) {
    progress(count, count);
  }
  return with_points(arrays, given.points);
}

/// (name, group, column, is_whole, list, member, where) of each output.
py::list fields() {
  py::list all;
  for (const auto& field : solver::result_fields()) {
    const auto* part = std::get_if<solver::ListPart>(&field.value);
    all.append(py::make_tuple(std::string(field.name), std::string(field.group),
                              std::string(field.column),
                              std::holds_alternative<solver::Member<std::int64_t>>(field.value),
                              part == nullptr ? "" : std::string(part->list->column),
                              part == nullptr ? "" : std::string(part->member),
                              part == nullptr ? "" : std::string(part->where)));
  }
  return all;
}

}  // namespace

void add_solving(py::module_& module) {
  py::class_<FallCache, Falls>(module, "Falls").def(py::init([] {
    return std::make_shared<FallCache>(protocol::available_memory_bytes() /
                                       solver::kFallsPartOfMemory);
  }));
  module.def("solve", &solve, py::arg("falls"), py::arg("keys"), py::arg("errors"));
  module.def("trace", &trace, py::arg("falls"), py::arg("keys"), py::arg("fall"), py::arg("shape"));
  module.def("solve_many", &solve_many, py::arg("falls"), py::arg("keys"), py::arg("points"),
             py::arg("threads"), py::arg("errors"), py::arg("progress"));
  // What threads have freed is kept for them otherwise.
  module.def("give_memory_back", [] { malloc_trim(0); });
  module.def("version", &version);
  module.def("fields", &fields);
  module.def("trace_states", [] {
    return std::vector<std::string>(solver::kTraceStates.begin(), solver::kTraceStates.end());
  });
  module.def("note_on_value", [](const std::string& key, double value) {
    return protocol::is_axis_key(key) ? solver::note_on_value(protocol::axis_key(key), value) : "";
  });
}

}  // namespace oblique::python
