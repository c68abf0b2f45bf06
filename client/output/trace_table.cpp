#include "client/output/trace_table.h"

#include "client/output/printer.h"
#include "worker/solver/model/number.h"

namespace oblique::client {

using solver::exact_number;

void print_trace_header(std::ostream& out, std::size_t links, std::size_t nodes) {
  out << "t_s,fn_N,ft_N,uy_m,ux_m,xP_m,vP_m_s,x_m,y_m,vt_m_s,vn_m_s,state";
  for (std::size_t i = 0; i < links; ++i) {
    out << ",R" << i << "x_N,R" << i << "y_N";
  }
  out << ",kinetic_J,strain_J,gravity_J,momentum_x_Ns,momentum_y_Ns";
  for (std::size_t i = 0; i < nodes; ++i) {
    out << ",node" << i << "x_m,node" << i << "y_m";
  }
  out << '\n';
}

void print_trace_row(std::ostream& out, const solver::TraceRow& row) {
  for (const double value : {row.t_s, row.fn_N, row.ft_N, row.uy_m, row.ux_m, row.xP_m, row.vP_m_s,
                             row.x_m, row.y_m, row.vt_m_s, row.vn_m_s}) {
    out << exact_number(value) << ',';
  }
  out << csv_field(row.state);
  for (const double reaction_N : row.reactions_N) {
    out << ',' << exact_number(reaction_N);
  }
  for (const double value :
       {row.kinetic_J, row.strain_J, row.gravity_J, row.momentum_x_Ns, row.momentum_y_Ns}) {
    out << ',' << exact_number(value);
  }
  for (const double position_m : row.nodes_m) {
    out << ',' << exact_number(position_m);
  }
  out << '\n';
}

}  // namespace oblique::client
