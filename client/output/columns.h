#pragma once

#include <string>
#include <vector>

#include "client/formats/row_printer.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// How tables for people show the column of that name, whose unit is `unit` (SI; empty: none, or
/// not known).
ShownColumn shown_column(const std::string& name, const std::string& unit = {});

/// The same for all columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

/// For tables that people read: columns whose values are small in SI units become those of
/// `solve`'s report, microseconds and the like, named in brackets in the heading.
protocol::QueryReply in_shown_units(protocol::QueryReply rows);

}  // namespace oblique::client
