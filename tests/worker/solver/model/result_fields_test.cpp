#include "worker/solver/model/result_fields.h"

#include <limits>
#include <set>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

/// Returns a result with one element in each list.
CaseResult with_lists() {
  CaseResult result{};
  result.peaks = {{1e-5, 4000.0, 2000.0, true}};
  result.ft_peaks = {{1e-5, 2000.0}};
  result.phases = {{PhaseKind::kCompression, 0.0, 1e-5}};
  result.stick_intervals = {{0.0, 1e-5}};
  result.reaction_peaks = {{1e-5, 900.0}};
  return result;
}

TEST(ResultFields, HaveOneMemberAndOneColumnEach) {
  std::set<std::string_view> columns;
  std::set<const void*> members;
  CaseResult result{};
  for (const auto& field : result_fields()) {
    EXPECT_TRUE(columns.insert(field.column).second) << field.column;
    EXPECT_FALSE(field.meaning.empty()) << field.column;
    std::visit(
        [&](const auto& value) {
          if constexpr (requires { value.in(result); }) {
            EXPECT_EQ(value.of(result) == nullptr, value.may_be_absent) << field.column;
            if (field.sent_with == SentWith::kPeaks) {
              return;
            }
            EXPECT_TRUE(members.insert(&value.in(result)).second) << field.column;
            EXPECT_EQ(value.of(result), &value.in(result)) << field.column;
          }
        },
        field.value);
  }
}

TEST(ResultFields, OfListsNameMembersOfTheirElements) {
  const CaseResult result = with_lists();
  for (const ResultList* list : result_lists()) {
    std::size_t elements = 0;
    list->each(result, [&](std::span<const Cell> element) {
      ++elements;
      EXPECT_EQ(element.size(), list->members.size()) << list->column;
    });
    EXPECT_EQ(elements, 1U) << list->column;
  }
  for (const auto& field : result_fields()) {
    const auto* part = std::get_if<ListPart>(&field.value);
    if (part == nullptr) {
      continue;
    }
    for (const auto member : {part->member, part->where}) {
      const auto& members = part->list->members;
      EXPECT_TRUE(member.empty() ||
                  std::find(members.begin(), members.end(), member) != members.end())
          << field.column << " has no " << member;
    }
  }
}

TEST(ResultFields, MajorPeaksExcludeRipplesAndAreAbsentIfThereAreFewer) {
  CaseResult result{};
  result.peaks = {
      {1e-5, 5057.0, 2023.0, true}, {2e-5, 40.0, 16.0, false}, {3e-5, 1516.0, 606.0, true}};
  const auto value = [&](std::string_view column) {
    return std::get<Member<double>>(find_result_column(column)->value).of(result);
  };
  EXPECT_EQ(*value("major_peak_1_N"), 5057.0);
  EXPECT_EQ(*value("major_peak_1_t_s"), 1e-5);
  EXPECT_EQ(*value("major_peak_2_N"), 1516.0);
  EXPECT_EQ(*value("major_peak_2_t_s"), 3e-5);
  EXPECT_EQ(value("major_peak_3_N"), nullptr);
  EXPECT_EQ(value("major_peak_3_t_s"), nullptr);
}

TEST(ResultFields, ANumberThatIsNotFiniteIsFoundInEveryField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(is_finite(with_lists()));
  for_each_sent<double>([&](const ResultField& field, const Member<double>& member) {
    CaseResult result = with_lists();
    member.in(result) = nan;
    EXPECT_FALSE(is_finite(result)) << field.column;
  });
  for (double* (*number)(CaseResult&) : {
           +[](CaseResult& result) { return &result.peaks[0].ft_N; },
           +[](CaseResult& result) { return &result.ft_peaks[0].t_s; },
           +[](CaseResult& result) { return &result.phases[0].t1_s; },
           +[](CaseResult& result) { return &result.stick_intervals[0].t0_s; },
           +[](CaseResult& result) { return &result.reaction_peaks[0].force_N; },
       }) {
    CaseResult result = with_lists();
    *number(result) = -std::numeric_limits<double>::infinity();
    EXPECT_FALSE(is_finite(result));
  }
}

}  // namespace
}  // namespace oblique::solver
