#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/study/study_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

std::string dotted(const std::string& part, int parts) {
  std::string key = part;
  for (int i = 1; i < parts; ++i) {
    key += "." + part;
  }
  return key;
}

struct WrongFile {
  std::string name;  // a sentence about what is wrong
  std::string text;
  std::vector<std::string> says;
};

class WrongStudyFile : public testing::TestWithParam<WrongFile> {};

TEST_P(WrongStudyFile, IsRefusedWithASentenceThatNamesWhatIsWrongAndWhatIsAllowed) {
  const auto& wrong = GetParam();
  try {
    parsed(wrong.text, "study.toml");
    FAIL() << "accepted:\n" << wrong.text;
  } catch (const solver::InputError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with("study.toml:")) << message;
    for (const auto& part : wrong.says) {
      EXPECT_NE(message.find(part), std::string::npos) << "no \"" << part << "\" in: " << message;
    }
  }
}

std::vector<WrongFile> wrong_tables() {
  return {
      {"NoToml", "name = \n", {":1:"}},
      {"KeyTwice", "name = 'a'\nname = 'b'\n", {":2:"}},
      {"UnknownTopKey", "nam = 'x'\n" + std::string(kPoint), {":1:1:", "`nam`", "`name`"}},
      {"PointKeyOutsideABlock", "mu = 0.4\n" + std::string(kPoint), {":1:", "`mu`", "[[block]]"}},
      {"ErrorsNoBoolean",
       "errors = 1\n" + std::string(kPoint),
       {":1:", "errors = 1", "true or false"}},
      {"NameNoString", "name = 3\n" + std::string(kPoint), {":1:", "name = 3", "a string"}},
      {"NameEmpty", "name = ''\n" + std::string(kPoint), {":1:", "name", "1 to 100 bytes"}},
      {"NameLikeAFlag", "name = '-x'\n" + std::string(kPoint), {":1:", "-x"}},
      {"NameWithEscape", "name = \"a\\u001b[2J\"\n" + std::string(kPoint), {":1:", "a\\x1b[2J"}},
      {"NameWithC1", "name = \"a\\u009b\"\n" + std::string(kPoint), {":1:", "a\\u009b"}},
      {"NameTurned", "name = \"a\\u202eb\"\n" + std::string(kPoint), {":1:", "a\\u202eb"}},
      {"NoBlock", "name = 'x'\n", {"[[block]]", "H, mu and e"}},
      {"EmptyBlockList", "block = []\n", {":1:", "empty"}},
      {"BlockNoTable", "block = [3]\n", {":1:", "[[block]]"}},
      {"BlockInSingleBrackets", "[block]\nH = 1\nmu = 0.4\ne = 1\n", {":1:", "[[block]]"}},
      {"ModelNoTable", "model = 3\n" + std::string(kPoint), {":1:", "[model]"}},
      {"UnknownModelKey",
       "[model]\nelements_per_lnk = 4\n" + std::string(kPoint),
       {":2:1:", "`elements_per_lnk`", "`elements_per_link`", "tip_mass"}},
      {"ModelKeyNoNumber",
       "[model]\nk = 'stiff'\n" + std::string(kPoint),
       {":2:", "k = ", "stiff", "a number"}},
      {"KeyOfMoreThanAHundredParts",
       "name = 'x'\n  " + dotted("a", 101) + " = 1\n",
       {":2: ", "100 parts"}},
      {"KeyOfFiftyThousandParts", dotted("a", 50'000) + " = 1\n", {":1: ", "100 parts"}},
      {"TableOfFiftyThousandParts",
       "[" + dotted(" 'a.\"' ", 50'000) + "]\n",
       {":1: ", "100 parts"}},
      {"KeyOfAHundredParts", dotted("a", 100) + " = 1\n", {":1:", "unknown key `a`"}},
      {"ModelKeyList",
       "[model]\nk = [1e7, 2e7]\n" + std::string(kPoint),
       {":2:", "k = [1e+07, 2e+07]", "[[block]]"}},
      {"NumbersAreRepeatedAsTheyWereWritten",
       "[model]\nk = [0.1, 0.3, 'x', [1]]\n" + std::string(kPoint),
       {":2:", "k = [0.1, 0.3, 'x', a list] is a list"}},
      {"ATableIsRepeatedWithItsKeys",
       "[model]\nk = { from = 0.1, to = 2 }\n" + std::string(kPoint),
       {":2:", "k = { from = 0.1, to = 2 } is a table"}},
      {"ModelKeyOutOfRange",
       "[model]\nrho = -1\n" + std::string(kPoint),
       {":2:", "rho = -1", "> 0"}},
      {"ModelKeyNan", "[model]\nrho = nan\n" + std::string(kPoint), {":2:", "rho = nan", "> 0"}},
      {"ElementsNotWhole",
       "[model]\nelements_per_link = 2.5\n" + std::string(kPoint),
       {":2:", "elements_per_link = 2.5", "whole number"}},
      {"PresetUnknown",
       "[model]\npreset = 'papre'\n" + std::string(kPoint),
       {":2:", "papre", "paper, printed, converged"}},
      {"PresetNoString", "[model]\npreset = 3\n" + std::string(kPoint), {":2:", "preset = 3"}},
      {"IntegratorUnknown",
       "[model]\nintegrator = 'euler'\n" + std::string(kPoint),
       {":2:", "euler", "explicit"}},
      {"IntegratorNoString",
       "[model]\nintegrator = 0\n" + std::string(kPoint),
       {":2:", "integrator = 0", "explicit"}},
      {"LengthsNoList",
       "[model]\nlengths = 0.4\n" + std::string(kPoint),
       {":2:", "lengths = 0.4", "list"}},
      {"LengthsEmpty", "[model]\nlengths = []\n" + std::string(kPoint), {":2:", "lengths = []"}},
      {"LengthsNoNumbers",
       "[model]\nlengths = [0.4, 'x']\n" + std::string(kPoint),
       {":2:", "lengths", "numbers"}},
      {"LengthsNegative",
       "[model]\nlengths = [0.4, -0.4]\n" + std::string(kPoint),
       {":2:", "-0.4", "> 0"}},
      {"LengthsBesideLinks",
       "[model]\nlengths = [0.4]\nlinks = 2\n" + std::string(kPoint),
       {":2:", "lengths", "links"}},
  };
}

std::vector<WrongFile> wrong_axes() {
  return {
      {"NoH", "[[block]]\nmu = 0.4\ne = 1\n", {":1:", "H is missing", "> 0"}},
      {"NoMu", "[[block]]\nH = 1\ne = 1\n", {":1:", "mu is missing", ">= 0"}},
      {"NoE", "[[block]]\nH = 1\nmu = 0.4\n", {":1:", "e is missing", "[0.001, 1]"}},
      {"UnknownAxis", block_with("mu = 0.4\nmuu = 1"), {":4:1:", "`muu`", "`mu`", "the keys are"}},
      {"PresetAsAxis", block_with("mu = 0.4\npreset = 'paper'"), {":4:", "preset", "[model]"}},
      {"MuNegative", block_with("mu = -0.4"), {":3:", "mu = -0.4", ">= 0"}},
      {"MuNan", block_with("mu = nan"), {":3:", "mu = nan", ">= 0"}},
      {"HInfinite", block_with("H = inf"), {":2:", "H = inf", "> 0"}},
      {"EZero", block_with("e = 0"), {":4:", "e = 0", "[0.001, 1]"}},
      {"EAboveOne", block_with("e = [0.5, 1.1]"), {":4:", "e = 1.1", "[0.001, 1]"}},
      {"AxisNoNumber", block_with("mu = 'rough'"), {":3:6: ", "mu", "rough"}},
      {"AxisTrue", block_with("mu = true"), {":3:", "mu = true", "a boolean"}},
      {"AxisListOfStrings", block_with("mu = ['a']"), {":3:", "a list of numbers"}},
      {"AxisElementNoNumber", block_with("mu = [\n0.4,\n'a',\n0.6]"), {":5:", "a list of numbers"}},
      {"AxisElementOutOfRange", block_with("mu = [\n0.4,\n0.5,\n-0.6]"), {":6:", "mu = -0.6"}},
      {"AxisElementUnknownIntegrator",
       block_with("mu = 0.4\nintegrator = [\n'explicit',\n'euler']"),
       {":6:", "euler"}},
      {"LengthsElementNegative",
       "[model]\nlengths = [\n0.4,\n-0.4]\n" + std::string(kPoint),
       {":4:", "-0.4", "> 0"}},
      {"EBelowWhatCanBeSolved", block_with("e = 0.0009"), {":4:", "e = 0.0009", "[0.001, 1]"}},
      {"ERangeFromBelowWhatCanBeSolved",
       block_with("e = { from = 1e-4, to = 1, count = 3 }"),
       {":4:", "e = 0.0001", "[0.001, 1]"}},
      {"AxisEmpty", block_with("mu = []"), {":3:", "mu = []", "at least one"}},
      {"AxisValueTwice", block_with("mu = [0.4, 0.4]"), {":3:", "0.4 twice"}},
      {"IntegratorAxisByNumber", block_with("mu = 0.4\nintegrator = [0]"), {":4:", "explicit"}},
      {"RangeReversed",
       block_with("mu = { from = 2, to = 1, count = 3 }"),
       {":3:", "from 2 to 1", "swap"}},
      {"RangeUnknownPart",
       block_with("mu = { from = 1, to = 2, cuont = 3 }"),
       {":3:", "`cuont`", "`count`"}},
      {"RangeWithoutTo", block_with("mu = { from = 1, count = 3 }"), {":3:6: ", "`to`"}},
      {"RangeWithoutCount", block_with("mu = { from = 1, to = 2 }"), {":3:", "`count` or `step`"}},
      {"RangeWithBoth",
       block_with("mu = { from = 1, to = 2, count = 2, step = 1 }"),
       {":3:", "either `count` or `step`"}},
      {"RangeFromNoNumber",
       block_with("mu = { from = 'a', to = 2, count = 2 }"),
       {":3:", "mu: from", "a number"}},
      {"RangeToNan", block_with("mu = { from = 1, to = nan, count = 2 }"), {":3:", "mu = nan"}},
      {"RangeOutOfDomain",
       block_with("e = { from = 0.5, to = 1.5, count = 2 }"),
       {":4:", "e = 1.5", "[0.001, 1]"}},
      {"CountZero",
       block_with("mu = { from = 1, to = 2, count = 0 }"),
       {":3:", "count = 0", "at least 1"}},
      {"CountNegative",
       block_with("mu = { from = 1, to = 2, count = -3 }"),
       {":3:", "count = -3", "at least 1"}},
      {"CountNotWhole",
       block_with("mu = { from = 1, to = 2, count = 2.5 }"),
       {":3:", "count = 2.5", "whole number"}},
      {"CountOneWithTwoEnds",
       block_with("mu = { from = 1, to = 2, count = 1 }"),
       {":3:", "count = 1", "both ends"}},
      {"CountManyWithEqualEnds",
       block_with("mu = { from = 1, to = 1, count = 3 }"),
       {":3:", "count = 3", "equal ends"}},
      {"CountBeyondAllBounds",
       block_with("mu = { from = 0, to = 1, count = 2000000000000 }"),
       {":1:", "1000000000000 points"}},
      {"StepZero", block_with("mu = { from = 1, to = 2, step = 0 }"), {":3:", "step = 0", "> 0"}},
      {"StepNegative",
       block_with("mu = { from = 1, to = 2, step = -0.5 }"),
       {":3:", "step = -0.5", "> 0"}},
      {"StepNan", block_with("mu = { from = 1, to = 2, step = nan }"), {":3:", "step = nan"}},
      {"StepThatDoesNotDivide",
       block_with("mu = { from = 0.5, to = 1, step = 0.2 }"),
       {":3:", "step = 0.2", "0.5 to 1", "0.9", "1.1"}},
      {"StepTooSmall",
       block_with("mu = { from = 0, to = 1, step = 1e-300 }"),
       {":3:", "step = 1e-300", "at most 1000000000000"}},
      {"WholeKeyBetweenWholeNumbers",
       block_with("mu = 0.4\nelements_per_link = { from = 2, to = 8, count = 3 }\nlinks = { from = "
                  "1, to = 2, count = 3 }"),
       {":5:", "links = 1.5", "whole number"}},
      {"HAboveTheChain", block_with("H = 1.3"), {":2:5: ", "H = 1.3", "1.2 m"}},
      {"HAboveAShorterChain",
       "[model]\nlengths = [0.4, 0.2]\n" + block_with("H = 0.7"),
       {":4:5: ", "H = 0.7", "0.6 m"}},
      {"HAboveTheLargestDrop", block_with("H = [1, 1.19]"), {":2:5: ", "H = 1.19", "1.179"}},
      {"SecondBlockWrong", std::string(kPoint) + block_with("H = 1.3"), {":6:5: ", "H = 1.3"}},
  };
}

std::vector<WrongFile> wrong_forms() {
  return {
      {"ADate", block_with("mu = 1979-05-27"), {":3:6: ", "a date or time"}},
      {"AHugeWholeNumber", block_with("mu = 9007199254740993"), {":3:6: ", "more digits"}},
      {"AHugerWholeNumber", block_with("mu = 99999999999999999999"), {":3:", "64 bits"}},
      {"SpacingUnknown",
       block_with("mu = { from = 1, to = 2, count = 3, spacing = 'lgo' }"),
       {":3:47: ", "lgo", "linear or log"}},
      {"LogarithmOfZero",
       block_with("mu = { from = 0, to = 2, count = 3, spacing = 'log' }"),
       {":3:6: ", "mu from 0", "above 0"}},
      {"LogarithmicSteps",
       block_with("mu = { from = 1, to = 2, step = 1, spacing = 'log' }"),
       {":3:", "`step`", "`count`"}},
      {"CsvNoString", block_with("mu = { csv = 3 }"), {":3:14: ", "mu: csv = 3", "in quotes"}},
      {"ColumnWithoutCsv", block_with("mu = { column = 'a' }"), {":3:6: ", "`csv`"}},
      {"CsvUnknownPart",
       block_with("mu = { csv = 'a.csv', colum = 'a' }"),
       {":3:23: ", "`colum` (did you mean `column`?)"}},
      {"DistributionUnknown",
       block_with("mu = { distribution = 'nromal', mean = 1, sd = 1 }"),
       {":3:6: ", "nromal", "uniform, log-uniform, normal"}},
      {"NormalWithoutSd",
       block_with("mu = { distribution = 'normal', mean = 1 }"),
       {":3:6: ", "needs mean and sd"}},
      {"UniformWithMean",
       block_with("mu = { distribution = 'uniform', from = 0, to = 1, mean = 1 }"),
       {":3:6: ", "needs from and to"}},
      {"DistributionOutsideASample",
       block_with("mu = { distribution = 'uniform', from = 0, to = 1 }"),
       {":3:6: ", "mu has a distribution", "`sample`"}},
      {"ZipNoBoolean",
       block_with("e = 1\nzip = 'yes'"),
       {":5:7: ", "zip = 'yes'", "true or false"}},
      {"ZipOfDifferentLengths",
       "[[block]]\nzip = true\nH = [0.5, 0.6]\nmu = [0.4, 0.5, 0.6]\ne = 1\n",
       {":3:5: ", "H has 2 values", "3"}},
      {"AxisOfAnEmptyText", block_with("mu = \"\""), {":3:6: ", "mu = \"\" is empty", "a number"}},
      {"BlockKeyMisspelt", block_with("e = 1\nwheer = 'mu > 1'"), {":5:1: ", "`wheer`", "`where`"}},
      {"ColumnsWithoutCsv", block_with("e = 1\ncolumns = { H = 'a' }"), {":5:11: ", "`csv`"}},
      {"SampleNoTable",
       block_with("e = 1\nsample = 'sobol'"),
       {":5:10: ", "sample = 'sobol'", "kind"}},
      {"SampleWithoutCount",
       block_with("e = 1\nsample = { kind = 'sobol' }"),
       {":5:10: ", "`count`"}},
      {"SampleKindUnknown",
       block_with("e = 1\nsample = { kind = 'sobl', count = 3 }"),
       {":5:10: ", "sobl", "did you mean `sobol`", "random, lhs, sobol"}},
      {"SampleCountNotWhole",
       block_with("e = 1\nsample = { kind = 'sobol', count = 1e5 }"),
       {":5:36: ", "count = 100000", "whole number"}},
      {"SampleCountZero",
       block_with("e = 1\nsample = { kind = 'lhs', count = 0 }"),
       {":5:10: ", "count = 0"}},
      {"SampleSeedNegative",
       block_with("e = 1\nsample = { kind = 'lhs', count = 1, seed = -1 }"),
       {":5:10: ", "seed = -1"}},
      {"SampleUnknownPart",
       block_with("e = 1\nsample = { kind = 'lhs', cuont = 1 }"),
       {":5:26: ", "`cuont` (did you mean `count`?)"}},
      {"WhereNoString", block_with("e = 1\nwhere = true"), {":5:9: ", "where = true", "in quotes"}},
      {"WhereNoCondition", block_with("e = 1\nwhere = 'mu >'"), {":5:9: ", "where"}},
      {"ExpressionOfAnUnknownKey", block_with("e = 1\nI = 'AA^2'"), {":5:5: ", "AA"}},
  };
}

std::string name_of(const testing::TestParamInfo<WrongFile>& info) {
  return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(Tables, WrongStudyFile, testing::ValuesIn(wrong_tables()), name_of);
INSTANTIATE_TEST_SUITE_P(Forms, WrongStudyFile, testing::ValuesIn(wrong_forms()), name_of);
INSTANTIATE_TEST_SUITE_P(Axes, WrongStudyFile, testing::ValuesIn(wrong_axes()), name_of);

}  // namespace
}  // namespace oblique::client
