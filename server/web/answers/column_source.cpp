#include "server/web/answers/column_source.h"

#include <algorithm>
#include <array>
#include <bit>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
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
  } else if (has(kOfModels, name) || name == "E_Pa") {
    source.sql = fmt::format("m.{}", name == "E_Pa" ? "E" : name);
    source.is_of_model = true;
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
          fmt::format("SELECT p.point, p.error IS NOT NULL, {} FROM packed_results AS p{} "
                      "WHERE p.study_id = ?1 AND p.point BETWEEN ?2 AND ?3",
                      source.sql,
                      source.is_of_model ? " JOIN models AS m ON m.model_id = p.model_id" : "")) {}

void ColumnReader::begin(std::uint64_t first, std::uint64_t last) {
  statement_.reset();
  statement_.bind(1, study_);
  statement_.bind(2, first);
  statement_.bind(3, last);
}

float ColumnReader::value() const {
  if (statement_.integer(1) != 0) {
    return failed_point();
  }
  return statement_.is_null(2) ? no_value() : static_cast<float>(statement_.real(2) / per_unit_);
}

}  // namespace oblique::server
