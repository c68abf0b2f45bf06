#include "client/paper/published_table.h"

#include <toml++/toml.h>

#include "client/paper/published_toml.h"

namespace oblique::client {
namespace {

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
  PublishedCase published;
  published.H_m = table["H"].value<double>().value();
  published.mu = table["mu"].value<double>().value();
  published.e_star = table["e"].value<double>().value();
  published.mode = table["mode"].value<std::string>().value();
  published.read = table["read"].value<std::string>().value();
  published.fn_kN = list<double>(table, "fn_kN");
  published.ft_kN = list<double>(table, "ft_kN");
  published.phases_ms = list<double>(table, "phases_ms");
  published.stick_ms = table["stick_ms"].value<double>();
  return published;
}

}  // namespace

PublishedTable published_table() {
  const auto top = toml::parse(kPublishedToml);
  PublishedTable published;
  for (const auto& node : *top["case"].as_array()) {
    published.cases.push_back(case_of(*node.as_table()));
  }
  for (const auto& node : *top["misprint"].as_array()) {
    const auto& table = *node.as_table();
    published.misprints.push_back({.where = table["where"].value<std::string>().value(),
                                   .printed = list<std::string>(table, "printed"),
                                   .why = table["why"].value<std::string>().value()});
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

}  // namespace oblique::client
