#include "proto/suggestion.h"

#include <array>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 5> kNames{"mu", "e", "H", "tip_mass", "elements_per_link"};

TEST(Suggestion, FindsWhatAMistypedWordWasMeantToBe) {
  EXPECT_EQ(nearest("tip_mas", kNames), "tip_mass");
  EXPECT_EQ(nearest("elements-per-link", kNames), "elements_per_link");
  EXPECT_EQ(nearest("MU", kNames), "mu");
}

TEST(Suggestion, SuggestsNothingForAWordUnlikeAll) {
  EXPECT_EQ(nearest("restitution", kNames), "");
  EXPECT_EQ(nearest("z", kNames), "");
  EXPECT_EQ(did_you_mean("zz", kNames), "");
}

TEST(Suggestion, SaysSoInASentence) {
  EXPECT_EQ(did_you_mean("muu", kNames), " (did you mean `mu`?)");
  EXPECT_EQ(joined(kNames), "mu, e, H, tip_mass, elements_per_link");
}

TEST(UnknownKey, RepeatsAtMostEightyCharactersOfIt) {
  EXPECT_EQ(unknown_key("muu", kNames), "unknown key `muu` (did you mean `mu`?)");
  EXPECT_EQ(unknown_key(std::string(10'000'000, 'k'), kNames),
            "unknown key `" + std::string(80, 'k') + "...`");
}

}  // namespace
}  // namespace oblique::protocol
