#pragma once

#include <string>
#include <vector>

#include "client/io/row_output.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// How tables for people show the column of that name, whose unit is `unit` (SI; empty: none, or
/// not known): one whose values are small in SI units in those of `solve`'s report, microseconds
/// and the like.
ShownColumn shown_column(const std::string& name, const std::string& unit = {});

/// The same for all columns of an answer.
std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk);

}  // namespace oblique::client
