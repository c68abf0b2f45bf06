#include "client/output/trace_table.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

solver::TraceRow row_of_two_links() {
  solver::TraceRow row{};
  row.t_s = 1e-6;
  row.fn_N = 0.1;
  row.ft_N = 2;
  row.uy_m = 3;
  row.ux_m = 4;
  row.xP_m = 5;
  row.vP_m_s = 6;
  row.x_m = 7;
  row.y_m = 8;
  row.vt_m_s = 9;
  row.vn_m_s = 10;
  row.state = "SC";
  row.reactions_N = {11, 12, -13, 14};
  row.kinetic_J = 15;
  row.strain_J = 16;
  row.gravity_J = -17;
  row.momentum_x_Ns = 18;
  row.momentum_y_Ns = -19;
  return row;
}

TEST(TraceTable, HasAColumnForEveryHeading) {
  std::string out;
  append_trace_header(out, {2, 0});
  append_trace_row(out, row_of_two_links());
  EXPECT_EQ(out,
            "t_s,fn_N,ft_N,uy_m,ux_m,xP_m,vP_m_s,x_m,y_m,vt_m_s,vn_m_s,state,"
            "R0x_N,R0y_N,R1x_N,R1y_N,"
            "kinetic_J,strain_J,gravity_J,momentum_x_Ns,momentum_y_Ns\n"
            "1e-06,0.1,2,3,4,5,6,7,8,9,10,SC,11,12,-13,14,15,16,-17,18,-19\n");
}

TEST(TraceTable, HasTwoColumnsForEachNodeOfAShape) {
  std::string header;
  append_trace_header(header, {1, 2});
  EXPECT_TRUE(header.ends_with("momentum_y_Ns,node0x_m,node0y_m,node1x_m,node1y_m\n")) << header;
  solver::TraceRow row = row_of_two_links();
  row.nodes_m = {0, 0, 0.5, -0.25};
  std::string line;
  append_trace_row(line, row);
  EXPECT_TRUE(line.ends_with(",18,-19,0,0,0.5,-0.25\n")) << line;
}

}  // namespace
}  // namespace oblique::client
