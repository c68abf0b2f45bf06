#pragma once

#include <string>

namespace oblique::protocol {

/// Why nothing can be connected to at `url`, or an empty text: a tcp address is tcp://HOST:PORT
/// with a port from 1 to 65535. Addresses of other kinds pass.
std::string objection_to_address(const std::string& url);

}  // namespace oblique::protocol
