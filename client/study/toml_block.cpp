#include "client/study/toml_block.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/study/toml_axis.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/written.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 5> kBlockKeys{"zip", "sample", "where", "csv", "columns"};
constexpr std::array<std::string_view, 3> kSampleParts{"kind", "count", "seed"};

/// One [[block]].
class BlockReader {
 public:
  BlockReader(const protocol::TomlReader& place, const toml::table& table, CsvFiles& files)
      : place_(place), table_(table), files_(files) {}

  protocol::Block block() {
    const bool has_file = table_.contains("csv");
    if (!has_file && table_.contains("columns")) {
      place_.fail(*table_.get("columns"), "columns stands without `csv`, the file");
    }
    const bool is_zip =
        has_file || (table_.contains("zip") && place_.yes("zip", *table_.get("zip")));
    const bool is_sample = table_.contains("sample");
    const auto kind = is_sample ? protocol::BlockKind::kSample
                      : is_zip  ? protocol::BlockKind::kZip
                                : protocol::BlockKind::kProduct;
    std::vector<protocol::Axis> axes;
    for (const auto& [key, value] : table_) {
      if (!is_block_key(key)) {
        const std::string_view name = key.str();
        place_.located(key, [name] { (void)protocol::axis_key(name); });
        axes.push_back(axis_of_toml(place_, name, value, kind, files_));
      }
    }
    if (has_file) {
      add_columns(axes);
    }
    protocol::Block block = protocol::block_of(std::move(axes));
    block.set_zip(is_zip);
    if (is_sample) {
      *block.mutable_sample() = sample(*table_.get("sample"));
    }
    if (const auto* where = table_.get("where")) {
      block.set_where(place_.text("where", *where, "a condition in quotes, as \"mu > 0.5 * e\""));
    }
    return block;
  }

 private:
  /// Throws for a key that resembles one of a block and none of an axis.
  bool is_block_key(const toml::key& written) const {
    const std::string_view key = written.str();
    if (std::find(kBlockKeys.begin(), kBlockKeys.end(), key) != kBlockKeys.end()) {
      return true;
    }
    if (!protocol::nearest(key, kBlockKeys).empty() && !protocol::is_axis_key(key)) {
      place_.fail(written, fmt::format("{}: beside its axes a block has {}",
                                       protocol::unknown_key(key, kBlockKeys),
                                       protocol::joined(kBlockKeys)));
    }
    return false;
  }

  protocol::Sample sample(const toml::node& node) const {
    const auto& sample =
        place_.table("sample", node, "{ kind = \"sobol\", count = 1000, seed = 1 }");
    place_.refuse_unknown(sample, kSampleParts, "sample: ", "a sample is { kind, count, seed }");
    if (!sample.contains("kind") || !sample.contains("count")) {
      place_.fail(
          node,
          fmt::format("sample = {} lacks {}: give kind and count, and a seed for other "
                      "points of the kind",
                      protocol::shown(sample), sample.contains("kind") ? "`count`" : "`kind`"));
    }
    const std::string kind =
        place_.text("sample: kind", *sample.get("kind"), "random, lhs or sobol, in quotes");
    const auto count = whole("count", *sample.get("count"));
    const auto seed =
        sample.contains("seed") ? whole("seed", *sample.get("seed")) : protocol::kUsualSeed;
    return place_.located(node, [&] { return protocol::written_sample(kind, count, seed); });
  }

  std::int64_t whole(std::string_view part, const toml::node& node) const {
    if (!node.is_integer()) {
      place_.fail(node, fmt::format("sample: {} = {} is not allowed: it must be a whole number, "
                                    "written without point and exponent",
                                    part, protocol::shown(node)));
    }
    return *node.value<std::int64_t>();
  }

  /// The axes that the columns of `csv` are: those that `columns` names, or each column by its own
  /// name.
  void add_columns(std::vector<protocol::Axis>& axes) const {
    const auto& node = *table_.get("csv");
    if (const auto* zip = table_.get("zip"); zip != nullptr && !place_.yes("zip", *zip)) {
      place_.fail(*zip, "zip = false stands beside csv: the lines of a file are points");
    }
    const std::string path = place_.text("csv", node, "the name of a file, in quotes");
    const CsvFile& file = place_.located(
        node, [&]() -> auto& { return files_.at(path); });
    if (const auto* columns = table_.get("columns")) {
      for (const auto& [key, column] :
           place_.table("columns", *columns, "a table from keys to columns, { H = \"drop\" }")) {
        const std::string name = place_.text(fmt::format("columns: {}", key.str()), column,
                                             "the name of a column, in quotes");
        add_column(axes, file, key.str(), name, column);
      }
      return;
    }
    for (const std::string& column : file.columns()) {
      add_column(axes, file, column, column, node);
    }
  }

  void add_column(std::vector<protocol::Axis>& axes, const CsvFile& file, std::string_view name,
                  const std::string& column, const toml::node& at) const {
    place_.located(at, [&] {
      if (table_.contains(name)) {
        throw solver::InputError(fmt::format(
            "{} is given twice: by the block and by a column of {}", name, file.name()));
      }
      if (!table_.contains("columns") && !protocol::is_axis_key(name)) {
        throw solver::InputError(
            fmt::format("the column `{}` of {} is called as no key: name the columns to take, as "
                        "columns = {{ H = \"drop\", mu = \"friction\" }}",
                        protocol::visible(name), file.name()));
      }
      const auto& key = protocol::axis_key(name);
      axes.push_back(
          protocol::listed_axis(key, file.values(column, key), protocol::BlockKind::kZip));
    });
  }

  const protocol::TomlReader& place_;
  const toml::table& table_;
  CsvFiles& files_;
};

}  // namespace

protocol::Block block_of_toml(const protocol::TomlReader& place, const toml::node& node,
                              CsvFiles& files) {
  const auto* table = node.as_table();
  if (table == nullptr) {
    place.fail(node, "block holds " + protocol::kind_of(node) +
                         ": write [[block]], and the axes below it");
  }
  return BlockReader(place, *table, files).block();
}

}  // namespace oblique::client
