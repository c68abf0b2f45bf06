#include "server/web/answers/column_source.h"

#include <algorithm>
#include <array>
#include <bit>

#include <spdlog/fmt/fmt.h>

#include "server/query/columns.h"
#include "server/store/rows/stored_units.h"

namespace oblique::server {
namespace {

constexpr std::array<std::string_view, 6> kPlainNumbers{"H",     "mu",        "e",
                                                        "steps", "mode_same", "attempt"};
constexpr std::array<std::string_view, 3> kTexts{"mode", "major_mode", "margin_event"};
constexpr std::array<std::string_view, 14> kOfModels{
    "links", "length", "A",        "I",  "rho",     "g",         "elements_per_link",
    "k",     "eta2",   "tip_mass", "dt", "dt_fall", "tolerance", "spectral_radius"};

template <typename Names>
bool has(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The value, or of a point that failed its error, a text, where no value is. Outputs of such a
/// point are NULL: its error is looked at only then, for every look costs at 10^6 rows.
std::string value_or_error(const ColumnSource& source) {
  return source.is_of_failed
             ? fmt::format("CASE WHEN p.error IS NULL THEN {} ELSE p.error END", source.sql)
             : fmt::format("coalesce({}, p.error)", source.sql);
}

}  // namespace

std::optional<ColumnSource> column_source(std::string_view name) {
  ColumnSource source;
  source.name = name;
  source.unit = unit_of_column(name);
  const auto units = stored_units();
  const auto unit = std::find_if(units.begin(), units.end(),
                                 [name](const StoredUnit& u) { return u.column == name; });
  if (unit != units.end()) {
    source.sql = fmt::format("p.{}", unit->stored);
    source.per_unit = unit->per_unit;
  } else if (has(kPlainNumbers, name) || has(kTexts, name)) {
    source.sql = fmt::format("p.{}", name);
    source.is_category = has(kTexts, name);
    source.is_of_failed = !source.is_category;
  } else if (has(kOfModels, name) || name == "E_Pa") {
    source.sql = fmt::format("m.{}", name == "E_Pa" ? "E" : name);
    source.is_of_model = true;
    source.is_of_failed = true;
  } else {
    return std::nullopt;
  }
  return source;
}

float no_result() {
  return std::bit_cast<float>(0x7fc00000U);
}
float failed_point() {
  return std::bit_cast<float>(0x7fc00001U);
}
float left_out() {
  return std::bit_cast<float>(0x7fc00002U);
}
float no_value() {
  return std::bit_cast<float>(0x7fc00003U);
}
float filtered_out() {
  return std::bit_cast<float>(0x7fc00004U);
}

bool is_same_mark(float one, float other) {
  return std::bit_cast<std::uint32_t>(one) == std::bit_cast<std::uint32_t>(other);
}

ColumnReader::ColumnReader(sqlite3* database, std::uint64_t study, const ColumnSource& source)
    : study_(study),
      per_unit_(source.per_unit),
      statement_(
          database,
          fmt::format("SELECT p.point, {} FROM packed_results AS p{} "
                      "WHERE p.study_id = ?1 AND p.point BETWEEN ?2 AND ?3 ORDER BY p.point",
                      value_or_error(source),
                      source.is_of_model ? " JOIN models AS m ON m.model_id = p.model_id" : "")) {}

void ColumnReader::begin(std::uint64_t first, std::uint64_t last) {
  statement_.reset();
  statement_.bind(1, study_);
  statement_.bind(2, first);
  statement_.bind(3, last);
}

float ColumnReader::value() const {
  switch (statement_.type(1)) {
    case SQLITE_NULL:
      return no_value();
    case SQLITE_TEXT:
      return failed_point();
    default:
      return static_cast<float>(statement_.real(1) / per_unit_);
  }
}

}  // namespace oblique::server
