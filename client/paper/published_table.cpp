#include "client/paper/published_table.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "client/paper/published_toml.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/written.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

template <typename Value>
Value required(const toml::table& table, std::string_view key) {
  const auto value = table[key].value<Value>();
  if (!value) {
    throw std::runtime_error("the published table lacks " + std::string(key) + " near line " +
                             std::to_string(table.source().begin.line));
  }
  return *value;
}

template <typename Value>
std::vector<Value> list(const toml::table& table, std::string_view key) {
  std::vector<Value> values;
  if (const auto* array = table[key].as_array()) {
    for (const auto& item : *array) {
      values.push_back(item.value<Value>().value());
    }
  }
  return values;
}

PublishedCase case_of(const toml::table& table) {
  return {.H_m = required<double>(table, "H"),
          .mu = required<double>(table, "mu"),
          .e_star = required<double>(table, "e"),
          .mode = required<std::string>(table, "mode"),
          .read = required<std::string>(table, "read"),
          .fn_kN = list<double>(table, "fn_kN"),
          .ft_kN = list<double>(table, "ft_kN"),
          .phases_ms = list<double>(table, "phases_ms"),
          .stick_ms = table["stick_ms"].value<double>()};
}

const toml::array& tables(const toml::table& top, std::string_view key) {
  const auto* array = top[key].as_array();
  if (array == nullptr || !array->is_homogeneous<toml::table>()) {
    throw std::runtime_error("the published table has no [[" + std::string(key) + "]]");
  }
  return *array;
}

}  // namespace

PublishedTable published_table() {
  return parse_published_table(kPublishedToml);
}

PublishedTable parse_published_table(std::string_view text) {
  const auto top = toml::parse(text);
  PublishedTable published;
  for (const auto& node : tables(top, "case")) {
    published.cases.push_back(case_of(*node.as_table()));
  }
  for (const auto& node : tables(top, "misprint")) {
    const auto& table = *node.as_table();
    published.misprints.push_back({.where = required<std::string>(table, "where"),
                                   .printed = list<std::string>(table, "printed"),
                                   .why = required<std::string>(table, "why")});
  }
  return published;
}

int published_peaks(const PublishedCase& published) {
  int peaks = 0;
  for (std::size_t i = 1; i < published.mode.size(); i += 3) {
    peaks += published.mode[i] == 'C' ? 1 : 0;
  }
  return peaks;
}

protocol::Recipe recipe_of(const PublishedTable& table, std::string_view preset) {
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(solver::preset(preset));
  for (const auto& published : table.cases) {
    const std::pair<std::string_view, double> values[]{
        {"H", published.H_m}, {"mu", published.mu}, {"e", published.e_star}};
    std::vector<protocol::Axis> axes;
    for (const auto& [key, value] : values) {
      axes.push_back(protocol::listed_axis(protocol::axis_key(key), {value}));
    }
    *recipe.add_blocks() = protocol::block_of(std::move(axes));
  }
  return recipe;
}

}  // namespace oblique::client
