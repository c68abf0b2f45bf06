#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// How tables for people show a column.
struct ShownColumn {
  std::string heading;    ///< its name, with the unit in brackets where that is not the SI one
  double per_unit = 1.0;  ///< so much is shown for 1 in SI units
};
ShownColumn shown_column(const std::string& name);

/// For tables that people read: columns whose values are small in SI units become those of
/// `solve`'s report, microseconds and the like, named in brackets in the heading.
protocol::QueryReply in_shown_units(protocol::QueryReply rows);

}  // namespace oblique::client
