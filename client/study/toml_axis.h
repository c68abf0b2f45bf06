#pragma once

#include <string_view>

#include <toml++/toml.h>

#include "client/study/csv_file.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/toml_reader.h"

namespace oblique::client {

/// The axis that the value of a key in a [[block]] of that kind means: a number, a list, a range, a
/// column of a CSV file, a distribution or an expression in quotes. Throws solver::InputError with
/// the place.
protocol::Axis axis_of_toml(const protocol::TomlReader& place, std::string_view key,
                            const toml::node& value, protocol::BlockKind kind, CsvFiles& files);

/// The number that a single value means; integrators go by their names.
double toml_number(const protocol::TomlReader& place, const solver::ParameterKey& key,
                   const toml::node& value, std::string_view expected);

}  // namespace oblique::client
