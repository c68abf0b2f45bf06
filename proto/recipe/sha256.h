#pragma once

#include <string>
#include <string_view>

namespace oblique::protocol {

/// SHA-256 in hexadecimal digits, as `sha256sum` prints it.
std::string sha256_of(std::string_view bytes);

}  // namespace oblique::protocol
