#include "server/study/recipe_growth.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostLines = 10;
/// Where more blocks differ no further ones are compared.
constexpr std::size_t kMostCompared = 200;
constexpr std::size_t kLongestShown = 60;

/// "key=value" of a line of a canonical text.
struct Field {
  std::string key;
  std::string value;

  bool operator==(const Field&) const = default;
};
using Fields = std::vector<Field>;

/// Whether a word of a line begins a field. Those of an expression do not.
bool begins_field(std::string_view word) {
  const std::size_t equals = word.find('=');
  return equals != std::string_view::npos && equals > 0 &&
         std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(equals), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
         });
}

/// The fields of a line, whose first word is its kind.
Fields fields_of(std::string_view line) {
  Fields fields;
  bool is_first = true;
  for (const std::string_view word : protocol::split(line, ' ')) {
    if (std::exchange(is_first, false)) {
      continue;
    }
    const std::size_t equals = word.find('=');
    if (begins_field(word)) {
      fields.push_back({std::string(word.substr(0, equals)), std::string(word.substr(equals + 1))});
    } else if (fields.empty()) {
      fields.push_back({std::string(word), "yes"});
    } else {
      fields.back().value += fmt::format(" {}", word);
    }
  }
  return fields;
}

/// The lines of the canonical text of a recipe that has these parts and nothing else.
std::vector<std::string> lines_of(const protocol::Recipe& recipe) {
  std::vector<std::string> lines;
  const std::string text = protocol::canonical_recipe(recipe);
  for (const std::string_view line : protocol::split(text, '\n')) {
    lines.emplace_back(line);
  }
  return lines;
}

/// The line of one block.
std::string line_of(const protocol::Block& block) {
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(solver::ModelParameters());  // any
  *recipe.add_blocks() = block;
  std::vector<std::string> lines = lines_of(recipe);
  constexpr std::size_t kBehindBlock = 2;  // nothing stands behind the last line feed
  return lines.at(lines.size() - kBehindBlock);
}

/// The line of its model.
std::string model_line_of(const protocol::Recipe& recipe) {
  protocol::Recipe model;
  *model.mutable_model() = recipe.model();
  return lines_of(model).at(1);
}

bool are_same(const protocol::Block& one, const protocol::Block& other) {
  return one.SerializeAsString() == other.SerializeAsString() || line_of(one) == line_of(other);
}

/// Whether the sample's points are those of one with fewer, and more behind them.
bool can_grow(const protocol::Sample& sample) {
  return sample.kind() != protocol::SAMPLE_LATIN_HYPERCUBE;
}

/// Whether `longer` is the block with a larger sample.
bool is_larger_sample(const protocol::Block& block, const protocol::Block& longer) {
  if (!block.has_sample() || !longer.has_sample() || !can_grow(block.sample()) ||
      longer.sample().count() <= block.sample().count()) {
    return false;
  }
  protocol::Block shortened = longer;
  shortened.mutable_sample()->set_count(block.sample().count());
  return are_same(block, shortened);
}

bool is_larger_hypercube(const protocol::Block& block, const protocol::Block& longer) {
  return block.has_sample() && longer.has_sample() &&
         block.sample().kind() == protocol::SAMPLE_LATIN_HYPERCUBE &&
         longer.sample().kind() == protocol::SAMPLE_LATIN_HYPERCUBE &&
         block.sample().count() != longer.sample().count();
}

/// Gathers lines about what differs.
class Difference {
 public:
  void add(std::string line) {
    ++found_;
    if (lines_.size() < kMostLines) {
      lines_.push_back(std::move(line));
    }
  }
  /// Two lines of canonical texts that say the same thing of both recipes.
  void compare(const std::string& where, const std::string& stored, const std::string& given) {
    const Fields was = fields_of(stored);
    const Fields is = fields_of(given);
    const std::size_t before = found_;
    for (const Field& field : was) {
      const auto other = find(is, field.key);
      if (other == is.end()) {
        add(fmt::format("{}, {}: stored {}, given none", where, field.key, shown(field.value)));
      } else if (other->value != field.value) {
        add(fmt::format("{}, {}: {}", where, field.key, both(field.value, other->value)));
      }
    }
    for (const Field& field : is) {
      if (find(was, field.key) == was.end()) {
        add(fmt::format("{}, {}: stored none, given {}", where, field.key, shown(field.value)));
      }
    }
    if (found_ == before) {
      add(fmt::format("{}: stored {}, given {}, in another order", where, keys(was), keys(is)));
    }
  }
  /// Enough is found to be shown.
  bool is_long() const { return found_ >= kMostCompared; }
  std::string text() const {
    std::string text = fmt::format("{}", fmt::join(lines_, "\n"));
    return found_ > lines_.size() ? fmt::format("{}\nand {} more{}", text, found_ - lines_.size(),
                                                is_long() ? " at least" : "")
                                  : text;
  }

 private:
  static Fields::const_iterator find(const Fields& fields, const std::string& key) {
    return std::find_if(fields.begin(), fields.end(),
                        [&](const Field& field) { return field.key == key; });
  }
  /// Long lists, from a little before the first place that differs.
  static std::string shown(const std::string& value, std::size_t from = 0) {
    constexpr std::size_t kBefore = 20;
    const std::size_t comma = from > kBefore && value.size() > kLongestShown
                                  ? value.rfind(',', from - kBefore)
                                  : std::string::npos;
    const std::size_t begin = comma == std::string::npos ? 0 : comma + 1;
    std::string part = protocol::shortened(value.substr(begin), kLongestShown);
    const bool is_cut = begin + part.size() < value.size();
    return fmt::format("{}{}{}", begin > 0 ? "..." : "", part, is_cut ? "..." : "");
  }
  static std::string both(const std::string& stored, const std::string& given) {
    const auto [at, other] =
        std::mismatch(stored.begin(), stored.end(), given.begin(), given.end());
    const auto place = static_cast<std::size_t>(at - stored.begin());
    return fmt::format("stored {}, given {}", shown(stored, place), shown(given, place));
  }
  static std::string keys(const Fields& fields) {
    std::string text;
    for (const Field& field : fields) {
      text += (text.empty() ? "" : " ") + field.key;
    }
    return text;
  }

  std::vector<std::string> lines_;
  std::size_t found_ = 0;
};

void compare_heads(const protocol::Recipe& stored, const protocol::Recipe& given,
                   Difference& difference, bool& differs) {
  const std::string model = model_line_of(stored);
  if (const std::string other = model_line_of(given); model != other) {
    difference.compare("model", model, other);
    differs = true;
    protocol::Recipe on_paper = given;
    on_paper.mutable_model()->set_elements_per_link(
        static_cast<std::uint32_t>(solver::preset("paper").elements_per_link));
    if (model_line_of(on_paper) == model) {
      difference.add(
          "preset = \"paper\" below [model], or --preset paper, goes on with the stored one");
    }
  }
  if (stored.errors() != given.errors()) {
    const auto told = [](bool errors) { return errors ? "true" : "false"; };
    difference.add(
        fmt::format("errors: stored {}, given {}", told(stored.errors()), told(given.errors())));
    differs = true;
  }
}

}  // namespace

Growth growth_of(const protocol::Recipe& stored, const protocol::Recipe& given) {
  Difference difference;
  bool differs = false;
  compare_heads(stored, given, difference, differs);
  const int common = std::min(stored.blocks_size(), given.blocks_size());
  bool grows = given.blocks_size() > stored.blocks_size();
  bool shrinks = given.blocks_size() < stored.blocks_size();
  for (int i = 0; i < common && !difference.is_long(); ++i) {
    const protocol::Block& was = stored.blocks(i);
    const protocol::Block& is = given.blocks(i);
    if (are_same(was, is)) {
      continue;
    }
    if (i + 1 == stored.blocks_size() && is_larger_sample(was, is)) {
      grows = true;
    } else if (i + 1 == given.blocks_size() && is_larger_sample(is, was)) {
      shrinks = true;
      difference.add(fmt::format("block {}: stored a sample of {} points, given {}", i + 1,
                                 was.sample().count(), is.sample().count()));
    } else if (is_larger_hypercube(was, is)) {
      differs = true;
      difference.add(
          fmt::format("block {}: stored a Latin hypercube of {} points, given {}: its "
                      "points change with their number, so it cannot grow",
                      i + 1, was.sample().count(), is.sample().count()));
    } else {
      differs = true;
      difference.compare(fmt::format("block {}", i + 1), line_of(was), line_of(is));
    }
  }
  if (!differs && given.blocks_size() < stored.blocks_size()) {
    difference.add(
        fmt::format("stored {} blocks, given {}", stored.blocks_size(), given.blocks_size()));
  }
  if (differs || (grows && shrinks)) {
    return {Growth::Kind::kOther, difference.text()};
  }
  if (shrinks) {
    return {Growth::Kind::kShorter, difference.text()};
  }
  return {grows ? Growth::Kind::kLonger : Growth::Kind::kSame, {}};
}

}  // namespace oblique::server
