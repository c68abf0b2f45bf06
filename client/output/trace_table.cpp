#include "client/output/trace_table.h"

#include <array>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::exact_number;
using solver::TraceRow;

struct Column {
  std::string_view name;
  double TraceRow::*value;
};

constexpr std::array kContact{
    Column{"t_s", &TraceRow::t_s},       Column{"fn_N", &TraceRow::fn_N},
    Column{"ft_N", &TraceRow::ft_N},     Column{"uy_m", &TraceRow::uy_m},
    Column{"ux_m", &TraceRow::ux_m},     Column{"xP_m", &TraceRow::xP_m},
    Column{"vP_m_s", &TraceRow::vP_m_s}, Column{"x_m", &TraceRow::x_m},
    Column{"y_m", &TraceRow::y_m},       Column{"vt_m_s", &TraceRow::vt_m_s},
    Column{"vn_m_s", &TraceRow::vn_m_s}};
constexpr std::array kChain{
    Column{"kinetic_J", &TraceRow::kinetic_J}, Column{"strain_J", &TraceRow::strain_J},
    Column{"gravity_J", &TraceRow::gravity_J}, Column{"momentum_x_Ns", &TraceRow::momentum_x_Ns},
    Column{"momentum_y_Ns", &TraceRow::momentum_y_Ns}};

}  // namespace

void print_trace_header(std::ostream& out, std::size_t links, std::size_t nodes) {
  for (const auto& column : kContact) {
    out << column.name << ',';
  }
  out << "state";
  for (std::size_t i = 0; i < links; ++i) {
    out << fmt::format(",R{0}x_N,R{0}y_N", i);
  }
  for (const auto& column : kChain) {
    out << ',' << column.name;
  }
  for (std::size_t i = 0; i < nodes; ++i) {
    out << fmt::format(",node{0}x_m,node{0}y_m", i);
  }
  out << '\n';
}

void print_trace_row(std::ostream& out, const TraceRow& row) {
  for (const auto& column : kContact) {
    out << exact_number(row.*column.value) << ',';
  }
  out << csv_field(row.state);
  for (const double reaction_N : row.reactions_N) {
    out << ',' << exact_number(reaction_N);
  }
  for (const auto& column : kChain) {
    out << ',' << exact_number(row.*column.value);
  }
  for (const double position_m : row.nodes_m) {
    out << ',' << exact_number(position_m);
  }
  out << '\n';
}

}  // namespace oblique::client
