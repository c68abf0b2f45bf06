#include "worker/solver/model/trace_columns.h"

#include <algorithm>

namespace oblique::solver {
namespace {

constexpr std::array kColumns{
    TraceColumn{"t_s", "s", "time since touch; negative in the fall", &TraceRow::t_s},
    TraceColumn{"fn_N", "N", "normal force on the tip, upwards, never negative", &TraceRow::fn_N},
    TraceColumn{"ft_N", "N", "tangential force on the tip, along x", &TraceRow::ft_N},
    TraceColumn{"uy_m", "m",
                "normal deformation of the contact, y + H: negative while it is pressed",
                &TraceRow::uy_m},
    TraceColumn{"ux_m", "m",
                "tangential deformation of the contact, x - xP; ft_N is -k/eta2 times it",
                &TraceRow::ux_m},
    TraceColumn{"xP_m", "m", "position along the ground of the contact particle P",
                &TraceRow::xP_m},
    TraceColumn{"vP_m_s", "m/s", "velocity of P along the ground; 0 in stick", &TraceRow::vP_m_s},
    TraceColumn{"x_m", "m", "position of the tip along x", &TraceRow::x_m},
    TraceColumn{"y_m", "m", "position of the tip along y", &TraceRow::y_m},
    TraceColumn{"vt_m_s", "m/s", "velocity of the tip along x", &TraceRow::vt_m_s},
    TraceColumn{"vn_m_s", "m/s", "velocity of the tip along y", &TraceRow::vn_m_s},
    TraceColumn{
        "state", "",
        "SC, SR, sC or sR, from this instant on; only where the fall is asked for: falling, "
        "when forces and deformations are 0 and P goes along with the tip",
        &TraceRow::state},
    TraceColumn{"R{}x_N R{}y_N", "N",
                "force on the outer link at O (0) and at each joint (1, 2, ...), along x and y",
                TraceVectors{&TraceRow::reactions_N, true}},
    TraceColumn{"kinetic_J", "J", "kinetic energy of the whole chain, tip mass included",
                &TraceRow::kinetic_J},
    TraceColumn{"strain_J", "J", "strain energy of the links: 0 when unstressed",
                &TraceRow::strain_J},
    TraceColumn{"gravity_J", "J", "potential energy: 0 at the height of O, negative below",
                &TraceRow::gravity_J},
    TraceColumn{"momentum_x_Ns", "N s", "linear momentum of the whole chain along x",
                &TraceRow::momentum_x_Ns},
    TraceColumn{"momentum_y_Ns", "N s", "linear momentum of the whole chain along y",
                &TraceRow::momentum_y_Ns},
    TraceColumn{"node{}x_m node{}y_m", "m",
                "only if the shape is requested: positions of the nodes from O to the tip; "
                "joints are listed once",
                TraceVectors{&TraceRow::nodes_m, false}},
};

std::size_t count_of(const TraceVectors& vectors, const TraceShape& shape) {
  return 2 * (vectors.of_links ? shape.links : shape.nodes);
}

/// Calls `take` with each number of a row, in the order of the columns.
template <class Row, class Take>
void for_each_number(Row& row, const Take& take) {
  for (const TraceColumn& column : kColumns) {
    if (const auto* number = std::get_if<double TraceRow::*>(&column.value)) {
      take(row.*(*number));
    } else if (const auto* vectors = std::get_if<TraceVectors>(&column.value)) {
      std::ranges::for_each(row.*(vectors->values), take);
    }
  }
}

}  // namespace

std::span<const TraceColumn> trace_columns() {
  return kColumns;
}

TraceShape trace_shape(std::size_t links, std::size_t elements_per_link, bool with_nodes) {
  return {links, with_nodes ? links * elements_per_link + 1 : 0};
}

std::vector<std::string> trace_headings(const TraceShape& shape) {
  std::vector<std::string> headings;
  for (const TraceColumn& column : kColumns) {
    const auto* vectors = std::get_if<TraceVectors>(&column.value);
    if (vectors == nullptr) {
      headings.emplace_back(column.name);
      continue;
    }
    const std::size_t space = column.name.find(' ');
    for (std::size_t i = 0; i < count_of(*vectors, shape); ++i) {
      std::string name(i % 2 == 0 ? column.name.substr(0, space) : column.name.substr(space + 1));
      headings.push_back(name.replace(name.find("{}"), 2, std::to_string(i / 2)));
    }
  }
  return headings;
}

std::uint8_t code_of_state(std::string_view state) {
  return static_cast<std::uint8_t>(std::ranges::find(kTraceStates, state) - kTraceStates.begin());
}

std::size_t trace_numbers(const TraceShape& shape) {
  std::size_t count = 0;
  for (const TraceColumn& column : kColumns) {
    const auto* vectors = std::get_if<TraceVectors>(&column.value);
    const bool is_number = std::holds_alternative<double TraceRow::*>(column.value);
    count += vectors != nullptr ? count_of(*vectors, shape) : (is_number ? 1 : 0);
  }
  return count;
}

void append_numbers(const TraceRow& row, std::vector<double>& numbers) {
  for_each_number(row, [&](double number) { numbers.push_back(number); });
}

TraceRow trace_row(const TraceShape& shape, std::span<const double> numbers,
                   std::string_view state) {
  TraceRow row{};
  row.state = state;
  row.reactions_N.resize(2 * shape.links);
  row.nodes_m.resize(2 * shape.nodes);
  auto next = numbers.begin();
  for_each_number(row, [&](double& number) { number = *next++; });
  return row;
}

}  // namespace oblique::solver
