#include "proto/recipe/sha256.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

std::string sum_of(const std::string& text, std::size_t piece) {
  Sha256 sum;
  for (std::size_t at = 0; at < text.size(); at += piece) {
    sum.add(std::string_view(text).substr(at, piece));
  }
  return hexadecimal(sum.digest());
}

// The examples of FIPS 180-4.
TEST(Sha256, HasTheValuesOfItsStandard) {
  EXPECT_EQ(sum_of("", 1), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sum_of("abc", 3), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sum_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sum_of(std::string(1'000'000, 'a'), 1000),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePiecesThatTheBytesComeIn) {
  const std::string text(300, 'x');
  for (std::size_t piece = 1; piece <= text.size(); ++piece) {
    EXPECT_EQ(sum_of(text, piece), sum_of(text, text.size()));
  }
}

}  // namespace
}  // namespace oblique::protocol
