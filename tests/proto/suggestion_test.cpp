#include "proto/suggestion.h"

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 5> kNames{"mu", "e", "H", "tip_mass", "elements_per_link"};

TEST(Suggestion, FindsTheNameThatAMistypedWordIsNearTo) {
  for (const auto& [word, name] : std::vector<std::pair<std::string_view, std::string_view>>{
           {"tip_mas", "tip_mass"},
           {"elements-per-link", "elements_per_link"},
           {"MU", "mu"},
           {"restitution", ""},
           {"z", ""}}) {
    EXPECT_EQ(nearest(word, kNames), name);
  }
  EXPECT_EQ(did_you_mean("zz", kNames), "");
  EXPECT_EQ(did_you_mean("muu", kNames), " (did you mean `mu`?)");
  EXPECT_EQ(joined(kNames), "mu, e, H, tip_mass, elements_per_link");
  EXPECT_EQ(unknown_key(std::string(10'000'000, 'k'), kNames),
            "unknown key `" + std::string(80, 'k') + "...`");
}

}  // namespace
}  // namespace oblique::protocol
