#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <spdlog/fmt/fmt.h>

#include "client/python/interpreter.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/system/resources.h"
#include "worker/solver/library/solver.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::python {
namespace {

namespace py = pybind11;

using Falls = std::shared_ptr<FallCache>;
using solver::Cell;
using solver::Member;

py::str text_of(std::string_view text) {
  return {text.data(), text.size()};
}

/// The outputs of many points as arrays. A missing number is NaN; a missing text has the index -1.
class ResultArrays {
 public:
  explicit ResultArrays(std::size_t points);

  /// Stores the result of one point. Not thread-safe; call it without the interpreter's lock.
  void set(std::size_t point, const solver::CaseResult& result);
  void set_error(std::size_t point, std::string_view error) { errors_.set(point, error); }

  /// Moves the outputs into a dict with the names of `oblique solve --json`. A number becomes an
  /// array. A text becomes (texts, index of each point's text or -1). `error` holds the errors.
  /// Each list in `lists` has an array for each member, and the `offsets` of the points.
  py::dict dict();

 private:
  /// Texts of many points; equal texts are stored once.
  struct Texts {
    explicit Texts(std::size_t points) : codes(points, -1) {}
    void set(std::size_t point, std::string_view text);
    py::tuple tuple() const;

    std::vector<std::int32_t> codes;
    std::map<std::string, std::int32_t, std::less<>> known;
    std::vector<std::string> texts;
  };
  /// The elements of one list for many points, in the order in which the points arrive.
  struct Elements {
    const solver::ResultList* list;
    std::vector<std::uint64_t> begin;  ///< for each point, the index of its first element
    std::vector<std::uint32_t> count;
    /// Values of each member. A text is stored as its index in `texts`.
    std::vector<std::vector<double>> members;
    std::vector<std::string> texts;
  };
  static double number_of(Elements& elements, const solver::Cell& cell);
  static py::dict dict_of(const Elements& elements);

  std::vector<std::vector<double>> numbers_;  ///< by field; empty for fields that are not numbers
  std::map<std::size_t, Texts> texts_;        ///< by field
  std::vector<Elements> lists_;
  Texts errors_;
};

void ResultArrays::Texts::set(std::size_t point, std::string_view text) {
  auto place = known.find(text);
  if (place == known.end()) {
    place = known.emplace(text, static_cast<std::int32_t>(texts.size())).first;
    texts.emplace_back(text);
  }
  codes[point] = place->second;
}

py::tuple ResultArrays::Texts::tuple() const {
  return py::make_tuple(texts, array_of(std::vector(codes)));
}

ResultArrays::ResultArrays(std::size_t points) : errors_(points) {
  const auto fields = solver::result_fields();
  numbers_.resize(fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (std::holds_alternative<Member<std::string>>(value)) {
      texts_.emplace(i, Texts(points));
    } else if (!std::holds_alternative<solver::ListPart>(value)) {
      numbers_[i].assign(points, std::numeric_limits<double>::quiet_NaN());
    }
  }
  for (const solver::ResultList* list : solver::result_lists()) {
    lists_.push_back({list,
                      std::vector<std::uint64_t>(points),
                      std::vector<std::uint32_t>(points),
                      std::vector<std::vector<double>>(list->members.size()),
                      {}});
  }
}

void ResultArrays::set(std::size_t point, const CaseResult& result) {
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (const auto* real = std::get_if<Member<double>>(&value); real && real->of(result)) {
      numbers_[i][point] = *real->of(result);
    }
    if (const auto* whole = std::get_if<Member<std::int64_t>>(&value); whole && whole->of(result)) {
      numbers_[i][point] = static_cast<double>(*whole->of(result));
    }
    if (const auto* text = std::get_if<Member<std::string>>(&value); text && text->of(result)) {
      texts_.at(i).set(point, *text->of(result));
    }
  }
  for (Elements& elements : lists_) {
    elements.begin[point] = elements.members.front().size();
    elements.list->each(result, [&](std::span<const Cell> element) {
      for (std::size_t i = 0; i < element.size(); ++i) {
        elements.members[i].push_back(number_of(elements, element[i]));
      }
      ++elements.count[point];
    });
  }
}

double ResultArrays::number_of(Elements& elements, const Cell& cell) {
  if (const auto* number = std::get_if<double>(&cell)) {
    return *number;
  }
  if (const auto* flag = std::get_if<bool>(&cell)) {
    return *flag ? 1.0 : 0.0;
  }
  const auto text = std::get<std::string_view>(cell);
  const auto found = std::find(elements.texts.begin(), elements.texts.end(), text);
  const auto place = found - elements.texts.begin();
  if (found == elements.texts.end()) {
    elements.texts.emplace_back(text);
  }
  return static_cast<double>(place);
}

// Sorts the elements by point.
py::dict ResultArrays::dict_of(const Elements& elements) {
  const std::size_t points = elements.begin.size();
  std::vector<std::int64_t> offsets{0};
  for (const std::uint32_t count : elements.count) {
    offsets.push_back(offsets.back() + count);
  }
  py::dict named;
  for (std::size_t member = 0; member < elements.members.size(); ++member) {
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(offsets.back()));
    for (std::size_t i = 0; i < points; ++i) {
      const auto begin =
          elements.members[member].begin() + static_cast<std::ptrdiff_t>(elements.begin[i]);
      values.insert(values.end(), begin, begin + elements.count[i]);
    }
    named[text_of(elements.list->members[member])] = array_of(std::move(values));
  }
  named["offsets"] = array_of(std::move(offsets));
  named["texts"] = py::cast(elements.texts);
  return named;
}

py::dict ResultArrays::dict() {
  py::dict all;
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (std::holds_alternative<solver::ListPart>(value)) {
      continue;
    }
    const py::str group = text_of(fields[i].group);
    if (!fields[i].group.empty() && !all.contains(group)) {
      all[group] = py::dict();
    }
    py::dict named = fields[i].group.empty() ? all : py::dict(all[group]);
    if (std::holds_alternative<Member<std::string>>(value)) {
      named[text_of(fields[i].name)] = texts_.at(i).tuple();
    } else {
      named[text_of(fields[i].name)] = array_of(std::move(numbers_[i]));
    }
  }
  py::dict lists;
  for (const Elements& list : lists_) {
    lists[text_of(list.list->column)] = dict_of(list);
  }
  all["lists"] = lists;
  all["error"] = errors_.tuple();
  return all;
}

/// Points with their models.
struct GivenPoints {
  std::vector<ModelParameters> models;
  std::vector<std::string> faults;  // error of each model; empty if the model is valid
  std::vector<ModelPoint> points;
};

constexpr std::string_view kIntegrator = "integrator";

double number_of_integrator(const std::string& name) {
  return static_cast<double>(solver::integrator_named(name));
}

std::vector<double> values_of(std::string_view key, const py::handle& array) {
  if (key != kIntegrator || array.attr("dtype").attr("kind").cast<std::string>() != "U") {
    return array.cast<std::vector<double>>();
  }
  std::vector<double> numbers;
  for (const auto& name : array.cast<std::vector<std::string>>()) {
    numbers.push_back(number_of_integrator(name));
  }
  return numbers;
}

/// Adds the key `name`. A single number goes to `model` if the key belongs to the model. Other
/// values go to axes[key_number(name)]: a number of a point key or of a link, a text (expression),
/// or an array with one value per point.
void add_key(protocol::ModelInput& model, std::map<std::size_t, protocol::Axis>& axes,
             const std::string& name, const py::handle& value) {
  const std::size_t number = protocol::key_number(name);
  protocol::Axis axis;
  axis.set_key(name);
  if (py::isinstance<py::array>(value)) {
    const auto values = values_of(name, value);
    axis.mutable_values()->Add(values.begin(), values.end());
  } else if (py::isinstance<py::str>(value) && name != kIntegrator) {
    axis.set_expression(value.cast<std::string>());
  } else {
    const bool is_text = py::isinstance<py::str>(value);
    const double one =
        is_text ? number_of_integrator(value.cast<std::string>()) : value.cast<double>();
    if (!protocol::is_point_key(number) && !protocol::link_of_key(number)) {
      model.values[name] = one;
      return;
    }
    solver::check_value(protocol::key_numbered(number), one);
    axis.add_values(one);
  }
  axes[number] = std::move(axis);
}

/// Adds the model `base` with `values` for `keys`, or the error of this model.
void add_model(GivenPoints& all, std::span<const double> values,
               const std::vector<std::size_t>& keys, const ModelParameters& base) {
  std::string fault;
  ModelParameters model = base;
  try {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& key = protocol::key_numbered(keys[i]);
      solver::check_value(key, values[i]);
      const auto link = protocol::link_of_key(keys[i]);
      if (!link) {
        key.set(model, values[i]);
      } else if (*link < model.lengths_m.size()) {
        model.lengths_m[*link] = values[i];
      } else {
        throw InputError(fmt::format("{} is not allowed: links are numbered from 1 to {}", key.name,
                                     model.lengths_m.size()));
      }
    }
    solver::validate(model);
  } catch (const InputError& error) {
    model = base;
    fault = error.what();
  }
  all.models.push_back(std::move(model));
  all.faults.push_back(std::move(fault));
}

std::vector<double> lengths_of(const py::handle& value) {
  const auto array = py::cast<py::array_t<double>>(value);
  if (array.ndim() != 1 || array.size() == 0) {
    throw InputError("lengths must be the length of each link, as [0.4, 0.4, 0.3]");
  }
  return array.cast<std::vector<double>>();
}

/// Reads a dict of numbers, texts (expressions), arrays of `points` values, and a list `lengths`.
/// Throws InputError, with key, value and allowed range, for an unknown key (with the nearest known
/// key), a wrong combination, and a value that is wrong for all points. If only some
/// values of an array are wrong, the errors belong to their models or points.
GivenPoints points_of(const py::dict& keys, std::size_t points) {
  protocol::ModelInput model;
  std::map<std::size_t, protocol::Axis> keyed_axes;
  if (!py::isinstance<py::str>(keys["preset"])) {
    throw InputError(
        fmt::format("preset = {} is not allowed: preset must be a name, such as \"paper\"",
                    py::repr(keys["preset"]).cast<std::string>()));
  }
  model.preset = keys["preset"].cast<std::string>();
  const bool has_lengths = keys.contains("lengths");
  for (const auto& [key, value] : keys) {
    const auto name = key.cast<std::string>();
    if (name == "lengths") {
      model.lengths_m = lengths_of(value);
    } else if (name != "preset") {
      add_key(model, keyed_axes, name, value);
    }
    if (has_lengths && (name == "links" || name == "length")) {
      throw InputError(std::string(protocol::ModelInput::kLengthsConflict));
    }
  }
  const ModelParameters base = model.model();
  GivenPoints all;
  if (points == 0) {
    return all;
  }
  std::vector<protocol::Axis> axes;
  std::vector<std::size_t> model_keys;
  for (auto& [number, axis] : keyed_axes) {
    axes.push_back(std::move(axis));
    if (!protocol::is_point_key(number)) {
      model_keys.push_back(number);
    }
  }
  protocol::Block block = protocol::block_of(std::move(axes));
  block.set_zip(true);
  // Index of each model, by the bits of its values: as a number, NaN would not equal itself.
  std::map<std::vector<std::uint64_t>, std::size_t> known;
  all.points.reserve(points);
  const auto add = [&](std::span<const double> values) {
    std::vector<std::uint64_t> bits;
    for (std::size_t j = 0; j < model_keys.size(); ++j) {
      bits.push_back(std::bit_cast<std::uint64_t>(values[j]));
    }
    const auto [place, is_new] = known.try_emplace(std::move(bits), all.models.size());
    if (is_new) {
      add_model(all, values, model_keys, base);
    }
    const auto point = values.subspan(keyed_axes.size() - protocol::kPointKeyOrder.size());
    all.points.push_back({place->second, {point[0], point[1], point[2]}});
  };
  protocol::PointTable::visit_values(base, block, points, add);
  return all;
}

/// Returns one point with its model, ready to be solved.
GivenPoints one_point(const py::dict& keys) {
  GivenPoints given = points_of(keys, 1);
  if (!given.faults.front().empty()) {
    throw InputError(given.faults.front());
  }
  return given;
}

/// Returns the outputs with the values of H, mu and e.
py::dict with_points(ResultArrays& arrays, const std::vector<ModelPoint>& points) {
  py::dict all = arrays.dict();
  const auto column = [&points](double Point::*member) {
    std::vector<double> values;
    for (const ModelPoint& point : points) {
      values.push_back(point.point.*member);
    }
    return array_of(std::move(values));
  };
  all["H"] = column(&Point::H_m);
  all["mu"] = column(&Point::mu);
  all["e"] = column(&Point::e_star);
  return all;
}

py::dict dict_of(const GivenPoints& one, const CaseResult& result) {
  ResultArrays arrays(1);
  arrays.set(0, result);
  return with_points(arrays, one.points);
}

py::dict solve(const Falls& falls, const py::dict& keys, bool errors) {
  const GivenPoints one = one_point(keys);
  const auto result = interruptibly<CaseResult>([one, falls, errors](const std::atomic<bool>&) {
    const Finger finger(one.models.front(), falls);
    const Point& point = one.points.front().point;
    CaseResult solved = finger.solve(point.H_m, point.mu, point.e_star);
    if (errors) {
      solved.errors = errors_by_companion(one.models.front(), solved, *falls);
    }
    return solved;
  });
  return dict_of(one, result);
}

/// The result of a point, and the numbers and the state of each instant of its trace.
struct Instants {
  CaseResult result;
  std::vector<double> numbers;
  std::vector<std::uint8_t> states;
};

py::tuple trace(const Falls& falls, const py::dict& keys, bool fall, bool shape) {
  const GivenPoints one = one_point(keys);
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
    const Point& point = one.points.front().point;
    rows.result =
        Finger(one.models.front(), falls).solve(point.H_m, point.mu, point.e_star, tracing);
    return rows;
  });
  const ModelParameters& model = one.models.front();
  const auto headings = solver::trace_headings(solver::trace_shape(
      model.lengths_m.size(), static_cast<std::size_t>(model.elements_per_link), shape));
  return py::make_tuple(dict_of(one, instants.result), headings,
                        array_of(std::move(instants.numbers)),
                        array_of(std::move(instants.states)));
}

/// State of a call of solve_many. The threads share it and may outlive the call.
struct ManyPoints {
  ManyPoints(std::size_t points, GivenPoints with_models)
      : given(std::move(with_models)), arrays(points) {}

  GivenPoints given;
  ResultArrays arrays;
  std::atomic<std::size_t> outcomes = 0;

  void solve(ManyOptions options, const std::atomic<bool>& stop) {
    std::vector<ModelPoint> points;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < given.points.size(); ++i) {
      if (const std::string& fault = given.faults[given.points[i].model]; !fault.empty()) {
        arrays.set_error(i, fault);
      } else {
        points.push_back(given.points[i]);
        places.push_back(i);
      }
    }
    options.goes_on = [this, &stop](std::size_t so_far) {
      outcomes = so_far;
      return !stop;
    };
    const auto take = [this, &places](Outcome&& outcome) {
      const std::size_t place = places[outcome.number];
      if (outcome.result) {
        arrays.set(place, *outcome.result);
      } else {
        arrays.set_error(place, outcome.error);
      }
    };
    oblique::solve_many(given.models, points, take, options);
  }
};

py::dict solve_many(const Falls& falls, const py::dict& keys, std::size_t count,
                    std::size_t threads, bool errors, const py::object& progress) {
  const auto many = std::make_shared<ManyPoints>(count, points_of(keys, count));
  threads = threads != 0 ? threads : protocol::usable_processors().count;
  const auto work = [many, threads, errors, falls](const std::atomic<bool>& stop) {
    many->solve({.threads = threads, .errors = errors, .falls = falls}, stop);
    return true;
  };
  interruptibly<bool>(work, {}, [&] {
    if (!progress.is_none()) {
      progress(many->outcomes.load(), count);
    }
  });
  if (!progress.is_none()) {
    progress(count, count);
  }
  return with_points(many->arrays, many->given.points);
}

/// Returns (name, group, column, is_whole, list, member, where) of each output.
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
