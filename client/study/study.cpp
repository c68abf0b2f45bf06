#include "client/study/study.h"

#include <charconv>

#include "worker/solver/model/errors.h"

namespace oblique::client {

Subject subject_of(std::string_view sentence) {
  constexpr std::string_view kBlock = "block ";
  constexpr std::string_view kPoint = "point ";
  constexpr std::string_view kEnd = ": ";
  const auto leave_out_first = [&] {
    const auto end = sentence.find(kEnd);
    sentence.remove_prefix(end == std::string_view::npos ? sentence.size() : end + kEnd.size());
  };
  std::size_t block = 1;
  if (sentence.starts_with(kBlock)) {
    std::from_chars(sentence.data() + kBlock.size(), sentence.data() + sentence.size(), block);
    leave_out_first();
  }
  if (sentence.starts_with(kPoint)) {
    leave_out_first();
  }
  return {block - 1, sentence.substr(0, sentence.find_first_of(" :"))};
}

void judge_points(const protocol::PointTable& table, const Located& located) {
  try {
    table.judge_points();
  } catch (const solver::InputError& error) {
    throw solver::InputError(located ? located(error.what()) : error.what());
  }
}

void judge_points(const Study& study) {
  judge_points(protocol::PointTable(study.recipe), study.located);
}

}  // namespace oblique::client
