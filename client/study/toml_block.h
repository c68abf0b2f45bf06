#pragma once

#include <toml++/toml.h>

#include "client/study/csv_file.h"
#include "proto/oblique.pb.h"
#include "proto/toml_reader.h"

namespace oblique::client {

/// A [[block]]: its axes, put together as `zip` and `sample` say, with the columns of the file
/// `csv` beside them, and `where`. Judges single axes alone. Throws solver::InputError with the
/// place.
protocol::Block block_of_toml(const protocol::TomlReader& place, const toml::node& node,
                              CsvFiles& files);

}  // namespace oblique::client
