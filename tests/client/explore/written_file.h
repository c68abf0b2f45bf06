#pragma once

#include <fstream>
#include <iterator>
#include <string>

namespace oblique::client {

/// The bytes of a file that a command wrote; empty if there is none.
inline std::string text_in_file(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace oblique::client
