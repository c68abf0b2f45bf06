#include "client/plot/figures/quantity.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client::plot {
namespace {

struct Words {
  std::string_view name;
  std::string_view words;
};

// What people call the columns that are drawn most.
constexpr std::array<Words, 34> kWords{{
    {"H", "drop H"},
    {"mu", "coefficient of friction \u03bc"},
    {"e", "coefficient of restitution e*"},
    {"length", "length of every link"},
    {"elements_per_link", "elements a link"},
    {"E_Pa", "Young's modulus E"},
    {"A", "cross-section area A"},
    {"I", "second moment of area I"},
    {"rho", "density \u03c1"},
    {"k", "contact stiffness k"},
    {"eta2", "stiffness ratio \u03b7\u00b2"},
    {"tip_mass", "mass at the tip"},
    {"fall_time_s", "time of the fall"},
    {"impact_x_m", "place of impact"},
    {"vt_in_m_s", "tangential velocity at touch"},
    {"vn_in_m_s", "normal velocity at touch"},
    {"duration_s", "duration of contact"},
    {"fn_peak_N", "largest normal force"},
    {"ft_peak_N", "largest tangential force"},
    {"impulse_n_Ns", "normal impulse"},
    {"impulse_t_Ns", "tangential impulse"},
    {"slide_m", "path of slide"},
    {"vt_out_m_s", "tangential velocity at separation"},
    {"vn_out_m_s", "normal velocity at separation"},
    {"stick_total_s", "time in stick"},
    {"margin", "margin to another order of events"},
    {"kinetic_in_J", "kinetic energy at touch"},
    {"friction_J", "energy lost to friction"},
    {"restitution_J", "energy lost in restitution"},
    {"kinetic_change_J", "change of kinetic energy"},
    {"strain_change_J", "change of strain energy"},
    {"gravity_change_J", "change of potential energy"},
    {"exchanged_J", "energy exchanged in contact"},
    {"closure", "closure of the energy balance"},
}};

/// "duration" of "duration_s": a unit in brackets need not stand in the name too.
std::string without_unit(const std::string& name, const std::string& unit) {
  std::string suffix = "_";
  for (const char letter : unit) {
    if (letter != ' ' && letter != '^') {
      suffix += letter == '/' ? '_' : letter;
    }
  }
  return !unit.empty() && name.ends_with(suffix) ? name.substr(0, name.size() - suffix.size())
                                                 : name;
}

std::string written(std::string_view unit) {
  return unit == "us" ? "\u00b5s" : std::string(unit);
}

}  // namespace

Quantity quantity_of(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  const bool has_own = field != nullptr && field->shown_per_unit != 1.0;
  Quantity quantity{.name = name, .label = {}, .per_unit = has_own ? field->shown_per_unit : 1.0};
  const auto words = std::find_if(kWords.begin(), kWords.end(),
                                  [&name](const Words& each) { return each.name == name; });
  quantity.label = words != kWords.end() ? std::string(words->words) : without_unit(name, unit);
  const std::string shown = has_own ? written(field->shown_unit) : unit;
  if (!shown.empty()) {
    quantity.label += fmt::format(" [{}]", shown);
  }
  return quantity;
}

FigureAxis axis_of(const Quantity& quantity, const Range& range, bool is_logarithmic) {
  return {quantity.label, quantity.name, range, is_logarithmic, quantity.per_unit};
}

std::string shown_value(const Quantity& quantity, double value) {
  const auto bracket = quantity.label.rfind(" [");
  const std::string unit =
      bracket == std::string::npos
          ? std::string()
          : ' ' + quantity.label.substr(bracket + 2, quantity.label.size() - bracket - 3);
  return fmt::format("{} = {}{}", quantity.name, solver::readable_number(value * quantity.per_unit),
                     unit);
}

}  // namespace oblique::client::plot
