#pragma once

#include <string>

namespace oblique::server {

/// The token in that file, which only its owner may read; one is drawn and written where there is
/// no file. Throws std::runtime_error that names the file and what is wrong.
std::string token_of_file(const std::string& path);

}  // namespace oblique::server
