#pragma once

#include <string>

#include "client/study/study_file.h"
#include "tests/client/study/fake_reach.h"

namespace oblique::client {

inline const std::string kPoint = "[[block]]\nH = 1\nmu = 0.4\ne = 1\n";

/// Returns a block of one point in which `line` replaces the line of its key: H, mu or e.
inline std::string block_with(const std::string& line) {
  std::string text = "[[block]]\n";
  for (const std::string key : {"H = 1\n", "mu = 0.4\n", "e = 1\n"}) {
    text += line.starts_with(key.substr(0, key.find(' ') + 1)) ? line + "\n" : key;
  }
  return text;
}

/// Parses a study file. Uses an invented largest drop of the tip instead of solving falls.
inline Study parsed(const std::string& text, const std::string& file = "x.toml") {
  return parse_study(text, file, fake_reach());
}

}  // namespace oblique::client
