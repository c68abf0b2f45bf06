#include "server/query/sql_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<std::string> kColumns{"H", "mu", "e", "E_Pa", "k", "fn_peak_N", "mode"};

/// What is said against `text`; empty: nothing.
std::string objection(const std::string& text, SqlPart part = SqlPart::kCondition) {
  try {
    check_sql_part("--where", text, part);
    check_case_of_columns("--where", text, kColumns);
    return {};
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

TEST(SqlText, WhatPeopleAskForIsAllowed) {
  for (const char* text : {"mu > 0.5",
                           "mu > 0.5 AND (e = 1 OR e < .5)",
                           "mode = 'sC -- sR; /* ? */'",
                           "H=1E5",
                           "fn_peak_N > 1e+3-2",
                           "mu BETWEEN 0x1F AND 1e-3",
                           "abs(mu-.5) < 1.E-3",
                           "MU(1) IS NULL",
                           "mu IN (SELECT max(mu) FROM runs WHERE e = 1 ORDER BY 1 LIMIT 1)",
                           "mode = 'it''s'",
                           "mu IS NOT DISTINCT FROM e",
                           "\"mu\" > 1 AND [e] = 1 AND `k` > 2",
                           "mode LIKE '%SC%'",
                           "CASE WHEN mu > 1 THEN e ELSE H END > .5",
                           "runs.mu > 1",
                           "E.mu > 1",
                           "x'0aE1' = mode",
                           "hex(mode) = 'E'",
                           "mode COLLATE NOCASE = 'sc'",
                           "mode->>'$[0]' = 1",
                           "mode || ':x' = '?'",
                           "fn_peak_N-mu-e>1"}) {
    EXPECT_EQ(objection(text), "") << text;
  }
  for (const char* text : {"*", "mu, e", "count(*), max(mu) AS E", "DISTINCT mode", "e E, mu",
                           "mu / 2 AS \"E\"", "fn_peak_N/1e3 AS Fn", "CAST(mu AS INTEGER) AS K"}) {
    EXPECT_EQ(objection(text, SqlPart::kColumns), "") << text;
  }
  for (const char* text : {"mu", "mu DESC, e", "abs(mu) DESC NULLS LAST", "2"}) {
    EXPECT_EQ(objection(text, SqlPart::kOrder), "") << text;
  }
}

TEST(SqlText, ANameThatDiffersFromAColumnInCaseIsRefusedWithTheRightOne) {
  EXPECT_THAT(objection("E > 1e10"),
              AllOf(HasSubstr("--where \"E > 1e10\" is not allowed"),
                    HasSubstr("E is no column, and SQL would take it for e: write e, or E_Pa")));
  EXPECT_THAT(objection("h = 1"), HasSubstr("write H"));
  EXPECT_THAT(objection("mu > 1 AND FN_PEAK_N > 1"), HasSubstr("write fn_peak_N"));
  for (const char* text : {"\"E\" > 1", "[E] > 1", "`E` > 1", "runs.E > 1", "abs(E) > 1",
                           "mu > 1 AND E > 1", "mu IN (E)", "-E > 1", "NOT E", "1E5 < E"}) {
    EXPECT_THAT(objection(text), HasSubstr("write e, or E_Pa")) << text;
  }
  EXPECT_THAT(objection("mu, E", SqlPart::kColumns), HasSubstr("write e"));
  EXPECT_THAT(objection("E DESC", SqlPart::kOrder), HasSubstr("write e"));
}

TEST(SqlText, AnErrorShowsTheBeginningOfALongText) {
  const std::string long_text = "mu > 1 AND (" + std::string(100'000, '1');
  EXPECT_LT(objection(long_text).size(), 1000U);
  EXPECT_THAT(objection(long_text), HasSubstr("--where \"mu > 1 AND (111"));
}

TEST(SqlText, AliasesMayBeUsedInTheirOwnCase) {
  const std::vector<std::string> kAliases{"E"};
  EXPECT_THAT(aliases_in("max(mu) AS E, e as \"Two \"\"words\"\"\", k"),
              ElementsAre("E", "Two \"words\""));
  EXPECT_NO_THROW(check_case_of_columns("--order", "E DESC", kColumns, kAliases));
  EXPECT_THROW(check_case_of_columns("--order", "MU", kColumns, kAliases), solver::InputError);
}

TEST(SqlText, NothingReachesBeyondItsPart) {
  const struct {
    const char* text;
    const char* says;
  } wrong[] = {{"mu > 0.5 --", "comment (--)"},
               {"mu /* x */ > 0.5", "comment (/*)"},
               {"mu > 0.5 /*", "comment (/*)"},
               {"mu > ?", "parameter (?)"},
               {"mu > ?1", "parameter (?)"},
               {"mu > :x", "parameter (:)"},
               {"mu > @x", "parameter (@)"},
               {"mu > $x", "parameter ($)"},
               {"mu > #1", "parameter (#)"},
               {"mu > 0.5; SELECT 1", "semicolon"},
               {"mu > 0.5) OR (1", "closed that was not opened"},
               {"(mu > 0.5", "bracket is not closed"},
               {"mode = 'x", "the quote ' is not closed"},
               {"mode = 'x'' --", "the quote ' is not closed"},
               {"\"mu > 1", "the quote \" is not closed"},
               {"[mu > 1", "the quote [ is not closed"},
               {"x'00 > 1", "the quote ' is not closed"},
               {"mu > 0.5 ORDER BY mu", "ORDER outside brackets"},
               {"1 LIMIT 1", "LIMIT outside brackets"},
               {"1 union select 1", "union outside brackets"},
               {"SELECT 1", "SELECT outside brackets"},
               {"mu, e", "comma outside brackets"},
               {" ", "it is empty"}};
  for (const auto& [text, says] : wrong) {
    EXPECT_THAT(objection(text), AllOf(HasSubstr(says), HasSubstr("must be one condition")))
        << text;
  }
  EXPECT_THAT(objection(std::string("mu\0> 1", 6)), HasSubstr("zero byte"));
  EXPECT_THAT(objection("mu > 1 AND \xEF\xBB\xBFmu"), HasSubstr("byte-order mark"));
  for (const char* text : {"mu FROM runs", "mu,", ",mu", "mu,,e", "mu --"}) {
    EXPECT_THAT(objection(text, SqlPart::kColumns), HasSubstr("must be columns or")) << text;
  }
  for (const char* text : {"mu LIMIT 1", "mu,", "mu --", "mu; SELECT 1"}) {
    EXPECT_THAT(objection(text, SqlPart::kOrder), HasSubstr("columns to sort by")) << text;
  }
}

}  // namespace
}  // namespace oblique::server
