#pragma once

#include <string>
#include <thread>

namespace oblique::test {

/// A peer beside the workers of a cycle, to whom the server sends what they seldom get: one whose
/// solver has another version gets a Notice; one that holds its batch, until others have solved it,
/// a Release.
class Companion {
 public:
  /// For that point of the kill matrix; for most there is none.
  Companion(const std::string& point, const std::string& server_url);

 private:
  std::jthread thread_;
};

}  // namespace oblique::test
