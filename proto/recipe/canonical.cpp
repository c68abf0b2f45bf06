#include "proto/recipe/canonical.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "proto/recipe/axes.h"
#include "proto/recipe/expressions/expression_text.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

constexpr std::string_view kModelHead = "oblique-model-1";
constexpr std::string_view kRecipeHead = "oblique-recipe-1\n";
/// Only where errors are asked for, so that recipes from before they could be keep their texts.
constexpr std::string_view kErrorsLine = "errors\n";
/// The keys of version 1 behind `lengths`, always written. Keys that came later are written behind
/// them, by name, where they are not at their default: what was encoded before they came stays so.
constexpr std::array<std::string_view, 13> kFirstKeys{"E",
                                                      "A",
                                                      "I",
                                                      "rho",
                                                      "g",
                                                      "elements_per_link",
                                                      "k",
                                                      "eta2",
                                                      "tip_mass",
                                                      "integrator",
                                                      "spectral_radius",
                                                      "dt",
                                                      "dt_fall"};
/// A piece is given away when it is as long.
constexpr std::size_t kPiece = 4096;

/// Shortest digits that read back as the same bits; both zeros are one.
std::string number(double value) {
  return solver::exact_number(value + 0.0);
}

bool is_integrator(std::string_view key) {
  return key == "integrator";
}

std::string value_of(std::string_view key, double value) {
  return is_integrator(key) && value >= 0.0 &&
                 value < static_cast<double>(solver::integrator_names().size())
             ? std::string(solver::integrator_names()[static_cast<std::size_t>(value)])
             : number(value);
}

std::vector<const solver::ParameterKey*> later_keys(std::span<const solver::ParameterKey> keys) {
  std::vector<const solver::ParameterKey*> later;
  for (const auto& key : keys) {
    const bool is_first =
        key.name == "links" || key.name == "length" ||
        std::find(kFirstKeys.begin(), kFirstKeys.end(), key.name) != kFirstKeys.end();
    if (!is_first) {
      later.push_back(&key);
    }
  }
  std::sort(later.begin(), later.end(),
            [](const auto* a, const auto* b) { return a->name < b->name; });
  return later;
}

/// " lengths=0.4,0.4,0.4 E=7e+10 ..."
std::string model_fields(const solver::ModelParameters& model,
                         std::span<const solver::ParameterKey> keys) {
  std::string text = " lengths=";
  for (std::size_t i = 0; i < model.lengths_m.size(); ++i) {
    text += i == 0 ? "" : ",";
    text += number(model.lengths_m[i]);
  }
  const auto add = [&](const solver::ParameterKey& key) {
    text += ' ';
    text += key.name;
    text += '=';
    text += value_of(key.name, key.get(model));
  };
  for (const std::string_view name : kFirstKeys) {
    add(*solver::find_model_key(name));
  }
  for (const auto* key : later_keys(keys)) {
    if (key->get(model) != key->get(solver::ModelParameters())) {
      add(*key);
    }
  }
  return text;
}

/// The range that has the listed values, or one of no values.
Axis as_range(const Axis& axis) {
  constexpr int kFewest = 3;  // two values are a range in any case
  if (axis.values_size() < kFewest || is_integrator(axis.key())) {
    return {};
  }
  Axis range;
  range.set_from(axis.values(0));
  range.set_to(axis.values(axis.values_size() - 1));
  range.set_count(static_cast<std::uint64_t>(axis.values_size()));
  if (!(range.from() < range.to())) {
    return {};
  }
  for (const Spacing spacing : {SPACING_LINEAR, SPACING_LOGARITHMIC}) {
    if (spacing == SPACING_LOGARITHMIC && !(range.from() > 0.0)) {
      break;
    }
    range.set_spacing(spacing);
    const RangeValues values(range);
    int i = 1;
    while (i < axis.values_size() && axis.values(i) == values.at(static_cast<std::uint64_t>(i))) {
      ++i;
    }
    if (i == axis.values_size()) {
      return range;
    }
  }
  return {};
}

/// Gathers text and gives it away in pieces.
class Pieces {
 public:
  explicit Pieces(const std::function<void(std::string_view)>& take) : take_(take) {}

  Pieces& operator<<(std::string_view text) {
    text_ += text;
    if (text_.size() >= kPiece) {
      finish();
    }
    return *this;
  }
  void finish() {
    take_(text_);
    text_.clear();
  }

 private:
  const std::function<void(std::string_view)>& take_;
  std::string text_;
};

void write_range(const Axis& range, Pieces& out) {
  out << number(range.from()) << ":" << number(range.to()) << ":" << std::to_string(range.count());
  if (range.spacing() == SPACING_LOGARITHMIC) {
    out << ":log";
  }
}

void write_distribution(const Distribution& drawn, Pieces& out) {
  const std::string from = drawn.has_from() ? number(drawn.from()) : "";
  const std::string to = drawn.has_to() ? number(drawn.to()) : "";
  switch (drawn.kind()) {
    case DISTRIBUTION_NORMAL:
      out << "normal(" << number(drawn.mean()) << "," << number(drawn.sd()) << "," << from << ","
          << to << ")";
      break;
    case DISTRIBUTION_LOG_UNIFORM:
      out << "log-uniform(" << from << "," << to << ")";
      break;
    default:
      out << "uniform(" << from << "," << to << ")";
  }
}

/// The tokens of an expression; of a text that is none, which nobody computes with, the text.
std::string expression(const std::string& text) {
  std::string bracketed("(");
  try {
    bracketed += expressions::read_expression(text).canonical;
  } catch (const solver::InputError&) {
    bracketed += text;
  }
  bracketed += ')';
  return bracketed;
}

/// An axis counts by its values: equally spaced ones are a range however they were written.
void write_axis(const Axis& axis, Pieces& out) {
  constexpr std::uint64_t kFewest = 3;  // two values are a range in any case
  out << " " << axis.key() << "=";
  if (axis.has_distribution()) {
    write_distribution(axis.distribution(), out);
    return;
  }
  if (!axis.expression().empty()) {
    out << expression(axis.expression());
    return;
  }
  if (const Axis range = axis.count() == 0 ? as_range(axis) : axis; range.count() >= kFewest) {
    write_range(range, out);
    return;
  }
  for (std::uint64_t i = 0; i < axis_size(axis); ++i) {
    out << (i == 0 ? "" : ",") << value_of(axis.key(), axis_value(axis, i));
  }
}

void write_block(const Block& block, Pieces& out) {
  out << "block";
  if (block.has_sample()) {
    const Sample& sample = block.sample();
    out << " sample="
        << (sample.kind() == SAMPLE_SOBOL             ? "sobol"
            : sample.kind() == SAMPLE_LATIN_HYPERCUBE ? "latin-hypercube"
                                                      : "random")
        << ":" << std::to_string(sample.count()) << ":" << std::to_string(sample.seed());
  } else if (block.zip()) {
    out << " zip";
  }
  for (const Axis& axis : block.axes()) {
    write_axis(axis, out);
  }
  if (!block.where().empty()) {
    out << " where=" << expression(block.where());
  }
  out << "\n";
}

[[noreturn]] void throw_not_canonical() {
  throw solver::InputError("it is not the canonical text of a model");
}

double read_number(std::string_view text) {
  const auto value = solver::number_of(text);
  if (!value) {
    throw_not_canonical();
  }
  return *value;
}

void read_field(solver::ModelParameters& model, std::string_view name, std::string_view value) {
  if (name == "lengths") {
    model.lengths_m.clear();
    for (const auto part : split(value, ',')) {
      model.lengths_m.push_back(read_number(part));
    }
    return;
  }
  const auto* key = solver::find_model_key(name);
  if (key == nullptr || name == "links" || name == "length") {
    throw_not_canonical();
  }
  const double set = is_integrator(name) ? static_cast<double>(solver::integrator_named(value))
                                         : read_number(value);
  if (name == "elements_per_link") {
    solver::check_value(*key, set);  // or the struct cannot hold it
  }
  key->set(model, set);
}

}  // namespace

std::string canonical_model(const solver::ModelParameters& model,
                            std::span<const solver::ParameterKey> keys) {
  return std::string(kModelHead) + model_fields(model, keys);
}

std::string canonical_model(const solver::ModelParameters& model) {
  return canonical_model(model, solver::model_keys());
}

solver::ModelParameters model_of_canonical(std::string_view text) {
  solver::ModelParameters model;
  for (const auto field : split(text, ' ')) {
    if (const auto equals = field.find('='); equals != std::string_view::npos) {
      read_field(model, field.substr(0, equals), field.substr(equals + 1));
    }
  }
  // One text a model: what is missing, twice or in another order shows here.
  if (canonical_model(model) != text) {
    throw_not_canonical();
  }
  return model;
}

void write_canonical(const Recipe& recipe, const std::function<void(std::string_view)>& take) {
  Pieces out(take);
  out << kRecipeHead << "model"
      << model_fields(unjudged_from_message(recipe.model()), solver::model_keys()) << "\n";
  if (recipe.errors()) {
    out << kErrorsLine;
  }
  for (const Block& block : recipe.blocks()) {
    write_block(block, out);
  }
  out.finish();
}

std::string canonical_recipe(const Recipe& recipe) {
  std::string text;
  write_canonical(recipe, [&](std::string_view piece) { text += piece; });
  return text;
}

Sha256::Digest recipe_digest(const Recipe& recipe) {
  Sha256 sum;
  write_canonical(recipe, [&](std::string_view piece) { sum.add(piece); });
  return sum.digest();
}

}  // namespace oblique::protocol
