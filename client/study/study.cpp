#include "client/study/study.h"

namespace oblique::client {

using solver::InputError;

InputError Places::located(const InputError& error) const {
  const auto& fields = error.fields();
  if (!fields.block && blocks.size() != 1) {
    return error.at(whole);
  }
  const auto& block = blocks.at(fields.block.value_or(0));
  const auto found = block.contains(fields.key) ? block.find(fields.key) : block.find("");
  return error.at(found != block.end() ? found->second : whole);
}

void judge_points(const protocol::PointTable& table, const Places& places) {
  try {
    table.judge_points();
  } catch (const InputError& error) {
    throw places.located(error);
  }
}

void judge_points(const Study& study) {
  judge_points(protocol::PointTable(study.recipe), study.places);
}

}  // namespace oblique::client
