#pragma once

#include <string>

namespace oblique::server {

/// Whether a server, which `oblique run` is too, has the database at `path` locked for its work. It
/// is not kept from anything by being asked after. False for a file that cannot be opened.
bool is_in_use(const std::string& path);

}  // namespace oblique::server
