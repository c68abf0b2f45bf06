#pragma once

#include <cstddef>
#include <string>

namespace oblique::client {

/// Help as CLI11 makes it, in lines of at most `width` characters where words allow it: meanings go
/// on below themselves, which is at `column`, and sentences in the next line. Commands are left
/// whole.
std::string fitted_help(const std::string& help, std::size_t width, std::size_t column);

}  // namespace oblique::client
