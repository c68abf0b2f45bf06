#include "server/asking/lists/list_functions.h"

#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/asking/lists/unpacking.h"
#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

/// SQLite's mark for texts that are JSON, so that functions of JSON take them in as such.
constexpr unsigned kJson = 'J';
constexpr std::int64_t kMostUnits = 999'999'999'999'999;

/// What calls of one function use again and again.
struct ListScratch {
  std::vector<std::int64_t> numbers;
  std::string text;
};

ListScratch& scratch_of(sqlite3_context* context) {
  return *static_cast<ListScratch*>(sqlite3_user_data(context));
}

/// A value that is a text, else an empty one.
std::string_view text_of(sqlite3_value* value) {
  if (sqlite3_value_type(value) != SQLITE_TEXT) {
    return {};
  }
  const auto* const bytes = reinterpret_cast<const char*>(sqlite3_value_text(value));
  return bytes == nullptr
             ? std::string_view()
             : std::string_view(bytes, static_cast<std::size_t>(sqlite3_value_bytes(value)));
}

/// No exception may pass through SQLite.
template <bool is_json, bool (*make)(sqlite3_value** arguments, ListScratch& scratch)>
void call(sqlite3_context* context, int, sqlite3_value** arguments) {
  try {
    ListScratch& scratch = scratch_of(context);
    if (make(arguments, scratch)) {
      sqlite3_result_text64(context, scratch.text.data(), scratch.text.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8);
      if (is_json) {
        sqlite3_result_subtype(context, kJson);
      }
    }
  } catch (const std::exception&) {
    sqlite3_result_error_nomem(context);
  }
}

bool peaks(sqlite3_value** arguments, ListScratch& scratch) {
  return read_packed(text_of(arguments[0]), scratch.numbers) &&
         unpack_peaks(scratch.numbers, scratch.text);
}

bool pairs(sqlite3_value** arguments, ListScratch& scratch) {
  constexpr int kMostStride = 3;
  constexpr int kMostDecimals = 15;
  const int stride = sqlite3_value_int(arguments[1]);
  const int second = sqlite3_value_int(arguments[2]);
  const int first_decimals = sqlite3_value_int(arguments[3]);
  const int second_decimals = sqlite3_value_int(arguments[4]);
  const auto is_unit = [](int decimals) { return decimals >= 0 && decimals <= kMostDecimals; };
  return stride > 0 && stride <= kMostStride && second >= 0 && is_unit(first_decimals) &&
         is_unit(second_decimals) && read_packed(text_of(arguments[0]), scratch.numbers) &&
         unpack_pairs(scratch.numbers,
                      {static_cast<std::size_t>(stride), static_cast<std::size_t>(second),
                       first_decimals, second_decimals},
                      scratch.text);
}

bool phases(sqlite3_value** arguments, ListScratch& scratch) {
  scratch.numbers.clear();
  if (sqlite3_value_type(arguments[1]) != SQLITE_INTEGER) {
    return false;
  }
  // Without a list there is no phase.
  if (sqlite3_value_type(arguments[0]) == SQLITE_NULL) {
    scratch.text = "[]";
    return true;
  }
  const std::int64_t duration = sqlite3_value_int64(arguments[1]);
  if (duration < -kMostUnits || duration > kMostUnits ||
      !read_packed(text_of(arguments[0]), scratch.numbers)) {
    return false;
  }
  scratch.numbers.push_back(duration);
  return unpack_phases(scratch.numbers, scratch.text);
}

bool member(sqlite3_value** arguments, ListScratch& scratch) {
  return member_of_elements(text_of(arguments[0]), sqlite3_value_int(arguments[1]),
                            sqlite3_value_int(arguments[2]), scratch.text);
}

}  // namespace

void add_list_functions(sqlite3* database) {
  constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS | SQLITE_SUBTYPE;
  const auto add = [&](const char* name, int arguments, auto function) {
    auto scratch = std::make_unique<ListScratch>();
    const auto forget = [](void* old) { delete static_cast<ListScratch*>(old); };
    // SQLite forgets it where it fails, too.
    if (sqlite3_create_function_v2(database, name, arguments, kFlags, scratch.release(), function,
                                   nullptr, nullptr, forget) != SQLITE_OK) {
      throw StorageError(std::string("no function ") + name + ": " + sqlite3_errmsg(database));
    }
  };
  add("unpacked_peaks", 1, &call<true, peaks>);
  add("unpacked_pairs", 5, &call<true, pairs>);
  add("unpacked_phases", 2, &call<true, phases>);
  add("list_member", 3, &call<false, member>);
}

}  // namespace oblique::server
