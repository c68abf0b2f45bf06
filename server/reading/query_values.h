#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk_writer.h"

namespace oblique::server {

/// As SQL writes a blob: x'0F..'.
std::string hexadecimal(std::string_view bytes);

/// What became of one value of a row.
enum class Copied { kYes, kTooLarge, kNoMemory };

/// Copies the value of `column` of the row at which `statement` stands. A blob comes as the text
/// x'0F..', as does a text that is not UTF-8. What would take more than `most_bytes` as text is not
/// copied.
Copied copy_value(sqlite3_stmt* statement, int column, std::uint64_t most_bytes,
                  protocol::Value& value);

/// The same into the next column of the row that `rows` is at; nothing is written unless it is
/// copied.
Copied copy_value(sqlite3_stmt* statement, int column, std::uint64_t most_bytes,
                  protocol::ChunkWriter& rows);

}  // namespace oblique::server
