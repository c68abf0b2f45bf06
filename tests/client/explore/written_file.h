#pragma once

#include <fstream>
#include <iterator>
#include <string>

namespace oblique::client {

/// Returns the bytes of a file that a command wrote; empty if the file does not exist.
inline std::string text_in_file(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace oblique::client
