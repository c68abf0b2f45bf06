#include "client/python/given_keys.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/written.h"
#include "proto/text.h"
#include "worker/solver/model/parameters.h"

namespace oblique::python {
namespace {

constexpr std::string_view kIntegrator = "integrator";

/// The values of one key: one for all points, or one a point.
using Values = std::vector<double>;

double at(const Values& values, std::size_t point) {
  return values.size() == 1 ? values.front() : values[point];
}

/// Values of all keys that were said, by the number of the key, computed where they follow from
/// others.
class KeyValues {
 public:
  KeyValues(const GivenKeys& given, const ModelParameters& base) : given_(given), base_(base) {
    for (const auto& [name, value] : given.numbers) {
      values_[protocol::key_number(name)] = {value};
    }
    for (const auto& [name, array] : given.arrays) {
      values_[protocol::key_number(name)] = array;
    }
    for (const auto& [name, text] : given.texts) {
      if (name != kIntegrator) {
        compute(protocol::key_number(name));
      }
    }
  }

  const std::map<std::size_t, Values>& all() const { return values_; }

 private:
  const Values& compute(std::size_t number) {
    const std::string name(protocol::key_numbered(number).name);
    if (const auto found = values_.find(number); found != values_.end()) {
      return found->second;
    }
    const auto text = given_.texts.find(name);
    if (text == given_.texts.end() || name == kIntegrator) {
      return values_of_base_[number] = {value_of_base(number)};
    }
    if (std::find(under_way_.begin(), under_way_.end(), number) != under_way_.end()) {
      throw InputError(fmt::format("{} = \"{}\" follows from itself", name, text->second));
    }
    under_way_.push_back(number);
    Values computed = computed_by(name, text->second);
    under_way_.pop_back();
    return values_[number] = std::move(computed);
  }

  Values computed_by(const std::string& name, const std::string& text) {
    try {
      expressions::Expression expression(text);
      std::vector<const Values*> arguments;
      std::size_t count = 1;
      for (const std::string& argument : expression.names()) {
        arguments.push_back(&compute(protocol::key_number(argument)));
        count = std::max(count, arguments.back()->size());
      }
      Values results(count);
      std::vector<double> here(arguments.size());
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = 0; j < here.size(); ++j) {
          here[j] = at(*arguments[j], i);
        }
        results[i] = expression.value_at(here);
      }
      return results;
    } catch (const InputError& error) {
      const std::string sentence = error.what();
      throw InputError(sentence.starts_with(name + " = \"")
                           ? sentence
                           : fmt::format("{} = \"{}\": {}", name, text, sentence));
    }
  }

  double value_of_base(std::size_t number) const {
    if (const auto link = protocol::link_of_key(number)) {
      if (*link >= base_.lengths_m.size()) {
        throw InputError(fmt::format("{} is the length of a link that there is not: there are {}",
                                     protocol::key_numbered(number).name, base_.lengths_m.size()));
      }
      return base_.lengths_m[*link];
    }
    const auto& key = protocol::key_numbered(number);
    if (key.get == nullptr) {
      throw InputError(fmt::format("{} is not given", key.name));
    }
    return key.get(base_);
  }

  const GivenKeys& given_;
  const ModelParameters& base_;
  std::map<std::size_t, Values> values_;
  std::map<std::size_t, Values> values_of_base_;
  std::vector<std::size_t> under_way_;
};

bool is_single_length(std::size_t number) {
  return protocol::link_of_key(number).has_value();
}

/// What the model is of which those with arrays differ: all keys that are one number, but single
/// lengths.
ModelParameters base_model(const GivenKeys& given) {
  protocol::WrittenModel model;
  model.set_preset(given.preset);
  for (const auto& [name, value] : given.numbers) {
    const std::size_t number = protocol::key_number(name);
    if (!protocol::is_point_key(number) && !is_single_length(number)) {
      model.set(name, value);
    }
  }
  if (const auto name = given.texts.find(std::string(kIntegrator)); name != given.texts.end()) {
    model.set(kIntegrator, static_cast<double>(solver::integrator_named(name->second)));
  }
  if (!given.lengths_m.empty()) {
    for (const char* const name : {"links", "length"}) {  // as numbers they are refused below
      if (given.texts.contains(name) || given.arrays.contains(name)) {
        throw InputError(std::string(protocol::WrittenModel::kLengthsStandAlone));
      }
    }
    model.set_lengths(given.lengths_m);
  }
  return model.model();
}

void set_key(ModelParameters& model, std::size_t number, double value) {
  const solver::ParameterKey& key = protocol::key_numbered(number);
  solver::check_value(key, value);
  const auto link = protocol::link_of_key(number);
  if (!link) {
    key.set(model, value);
    return;
  }
  if (*link >= model.lengths_m.size()) {
    throw InputError(fmt::format("{} is the length of a link that there is not: there are {}",
                                 key.name, model.lengths_m.size()));
  }
  model.lengths_m[*link] = value;
}

/// The models that points have, each once.
class Models {
 public:
  Models(const ModelParameters& base, const KeyValues& values, const GivenKeys& given,
         GivenPoints& out)
      : base_(base), out_(out) {
    for (const auto& [number, of_key] : values.all()) {
      const bool is_in_base =
          !is_single_length(number) &&
          given.numbers.contains(std::string(protocol::key_numbered(number).name));
      if (!protocol::is_point_key(number) && !is_in_base) {
        varied_.emplace_back(number, &of_key);
      }
    }
  }

  std::size_t of_point(std::size_t point) {
    std::vector<std::uint64_t> bits;  // of NaN too
    for (const auto& [number, of_key] : varied_) {
      bits.push_back(std::bit_cast<std::uint64_t>(at(*of_key, point)));
    }
    if (out_.models.empty() || bits != last_) {
      const auto [found, is_new] = known_.try_emplace(bits, out_.models.size());
      if (is_new) {
        add(point);
      }
      last_model_ = found->second;
      last_ = std::move(bits);
    }
    return last_model_;
  }

 private:
  void add(std::size_t point) {
    ModelParameters model = base_;
    std::string fault;
    try {
      for (const auto& [number, of_key] : varied_) {
        set_key(model, number, at(*of_key, point));
      }
      solver::validate(model);
    } catch (const InputError& error) {
      model = base_;
      fault = error.what();
    }
    out_.models.push_back(std::move(model));
    out_.faults.push_back(std::move(fault));
  }

  const ModelParameters& base_;
  GivenPoints& out_;
  std::vector<std::pair<std::size_t, const Values*>> varied_;
  std::map<std::vector<std::uint64_t>, std::size_t> known_;
  std::vector<std::uint64_t> last_;
  std::size_t last_model_ = 0;
};

}  // namespace

GivenPoints points_of(const GivenKeys& given) {
  const ModelParameters base = base_model(given);
  for (const auto& [name, value] : given.numbers) {
    if (const std::size_t number = protocol::key_number(name); protocol::is_point_key(number)) {
      solver::check_value(protocol::key_numbered(number), value);
    }
  }
  GivenPoints given_points;
  if (given.points == 0) {
    return given_points;
  }
  const KeyValues values(given, base);
  Models models(base, values, given, given_points);
  const auto of_key = [&values](const char* name) -> const Values& {
    const auto found = values.all().find(protocol::key_number(name));
    if (found == values.all().end()) {
      throw InputError(fmt::format("{} is missing", name));
    }
    return found->second;
  };
  const Values& H_m = of_key("H");
  const Values& mu = of_key("mu");
  const Values& e = of_key("e");
  given_points.points.reserve(given.points);
  for (std::size_t i = 0; i < given.points; ++i) {
    given_points.points.push_back({at(H_m, i), at(mu, i), at(e, i), models.of_point(i)});
  }
  return given_points;
}

}  // namespace oblique::python
