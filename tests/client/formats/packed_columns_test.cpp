#include "client/formats/packed_columns.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using nlohmann::ordered_json;

// null where nothing was unpacked.
ordered_json list_of(const std::string& column, const std::string& text) {
  const auto packed = packed_list(column);
  const auto list = packed ? unpacked(*packed, text) : std::nullopt;
  return list ? *list : ordered_json();
}

TEST(PackedColumns, AreTheListsOfSolveJson) {
  EXPECT_EQ(list_of("phases", R"([["compression",0.0,1e-05],["restitution",1e-05,3e-05]])"),
            ordered_json::parse(R"([{"kind":"compression","t0_s":0.0,"t1_s":1e-05},
                                    {"kind":"restitution","t0_s":1e-05,"t1_s":3e-05}])"));
  EXPECT_EQ(list_of("peaks", "[[1e-05,4000.5,2000.0,1]]"),
            ordered_json::parse(R"([{"t_s":1e-05,"fn_N":4000.5,"ft_N":2000.0,"major":1}])"));
  EXPECT_EQ(list_of("reaction_peaks", "[[1e-05,7.5]]"),
            ordered_json::parse(R"([{"t_s":1e-05,"force_N":7.5}])"));
  EXPECT_EQ(list_of("stick_intervals", "[[0.0,1e-05]]"), ordered_json::parse("[[0.0,1e-05]]"));
  EXPECT_EQ(list_of("fn_peaks_N", "[]"), ordered_json::array());
}

TEST(PackedColumns, KeepEveryBitOfANumber) {
  const auto list = list_of("fn_peaks_N", "[5057.6299999999992,0.1,5e-324]");
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].get<double>(), 5057.6299999999992);
  EXPECT_EQ(list[2].get<double>(), 5e-324);
}

TEST(PackedColumns, AreNoOthersWhateverTheirTextsLookLike) {
  EXPECT_FALSE(packed_list("name"));
  EXPECT_FALSE(packed_list("mode"));
}

TEST(PackedColumns, LeaveATextAloneThatIsNoSuchList) {
  for (const char* text : {"", "[1,2", "17", "{\"a\":[1]}", "[[1e-05,4000.5]]", "[1,2,3,4]",
                           "[[[1]]]", "[{\"a\":1}]"}) {
    EXPECT_TRUE(list_of("peaks", text).is_null()) << text;
  }
  const std::string deep(1000000, '[');
  EXPECT_TRUE(list_of("fn_peaks_N", deep).is_null());
  EXPECT_TRUE(list_of("fn_peaks_N", deep + std::string(1000000, ']')).is_null());
}

}  // namespace
}  // namespace oblique::client
