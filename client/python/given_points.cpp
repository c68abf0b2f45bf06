#include "client/python/given_points.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string_view>
#include <utility>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::python {
namespace {

namespace py = pybind11;

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

/// A key that is one number or text, or has a value for each point.
void add_key(GivenKeys& given, const std::string& name, const py::handle& value) {
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
      given.model.set(name, one);
      return;
    }
    solver::check_value(protocol::key_numbered(number), one);
    axis.add_values(one);
  }
  given.axes[number] = std::move(axis);
}

/// Adds the model with these values of `keys`, or its fault.
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
        throw InputError(fmt::format("{} is the length of a link that there is not: there are {}",
                                     key.name, model.lengths_m.size()));
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

}  // namespace

GivenKeys keys_of(const py::dict& keys, std::size_t points) {
  GivenKeys given{points, {}, {}};
  given.model.set_preset(keys["preset"].cast<std::string>());
  const bool has_lengths = keys.contains("lengths");
  for (const auto& [key, value] : keys) {
    const auto name = key.cast<std::string>();
    if (name == "lengths") {
      given.model.set_lengths(value.cast<std::vector<double>>());
    } else if (name != "preset") {
      add_key(given, name, value);
    }
    if (has_lengths && (name == "links" || name == "length")) {
      throw InputError(std::string(protocol::WrittenModel::kLengthsStandAlone));
    }
  }
  return given;
}

GivenPoints points_of(const GivenKeys& given) {
  const ModelParameters base = given.model.model();
  GivenPoints all;
  if (given.points == 0) {
    return all;
  }
  std::vector<protocol::Axis> axes;
  std::vector<std::size_t> model_keys;
  for (const auto& [number, axis] : given.axes) {
    axes.push_back(axis);
    if (!protocol::is_point_key(number)) {
      model_keys.push_back(number);
    }
  }
  protocol::Block block = protocol::block_of(std::move(axes));
  block.set_zip(true);
  std::map<std::vector<std::uint64_t>, std::size_t> known;  // models, by the bits of their values
  all.points.reserve(given.points);
  const auto add = [&](std::span<const double> values) {
    std::vector<std::uint64_t> bits;  // of NaN too
    for (std::size_t j = 0; j < model_keys.size(); ++j) {
      bits.push_back(std::bit_cast<std::uint64_t>(values[j]));
    }
    const auto [model, is_new] = known.try_emplace(std::move(bits), all.models.size());
    if (is_new) {
      add_model(all, values, model_keys, base);
    }
    const auto point = values.subspan(given.axes.size() - protocol::kPointKeyOrder.size());
    all.points.push_back({model->second, {point[0], point[1], point[2]}});
  };
  protocol::visit_values(base, block, given.points, add);
  return all;
}

}  // namespace oblique::python
