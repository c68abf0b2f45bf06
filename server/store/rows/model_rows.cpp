#include "server/store/rows/model_rows.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "proto/oblique.pb.h"
#include "proto/recipe/canonical.h"
#include "proto/recipe/model_message.h"

namespace oblique::server {
namespace {

std::string unreadable(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "unreadable ";
  for (const char letter : bytes) {
    const auto byte = static_cast<unsigned char>(letter);
    text += {kDigits[byte >> 4U], kDigits[byte & 0xfU]};
  }
  return text;
}

std::string present_definition(std::string_view bytes) {
  try {
    return protocol::canonical_model(model_of_definition(bytes, kFirstWithCanonicalModels - 1));
  } catch (const std::runtime_error&) {
    return unreadable(bytes);
  }
}

void model_definition(sqlite3_context* context, int /*count*/, sqlite3_value** values) {
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(values[0]));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(values[0]));
  try {
    const std::string text = present_definition({size == 0 ? "" : bytes, size});
    sqlite3_result_text64(context, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  } catch (const std::bad_alloc&) {
    sqlite3_result_error_nomem(context);
  }
}

}  // namespace

std::string definition_of(const solver::ModelParameters& model, int schema) {
  return schema >= kFirstWithCanonicalModels ? protocol::canonical_model(model)
                                             : protocol::to_message(model).SerializeAsString();
}

solver::ModelParameters model_of_definition(std::string_view definition, int schema) {
  if (schema >= kFirstWithCanonicalModels) {
    return protocol::model_of_canonical(definition);
  }
  protocol::ModelParameters message;
  if (!message.ParseFromArray(definition.data(), static_cast<int>(definition.size()))) {
    throw std::runtime_error("its bytes are damaged");
  }
  return protocol::unjudged_from_message(message);
}

std::string insert_model_sql() {
  // The keys are the columns, but for those handled first.
  std::string names = "definition, lengths_m";
  std::string marks = "?, ?";
  for (const auto& key : solver::model_keys()) {
    names += ", " + std::string(key.name);
    marks += ", ?";
  }
  return "INSERT INTO models (" + names + ") VALUES (" + marks +
         ") ON CONFLICT (definition) DO NOTHING";
}

void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition) {
  insert.reset();
  insert.bind(1, definition);
  insert.bind(2, nlohmann::json(model.lengths_m).dump());
  int index = 3;
  for (const auto& key : solver::model_keys()) {
    const double value = key.get(model);
    const bool whole = key.name == "links" || key.name == "elements_per_link";
    if (key.name == "integrator") {
      insert.bind(index, solver::integrator_name(model.integrator));
    } else if (whole) {
      insert.bind(index, static_cast<std::int64_t>(value));
    } else if (key.name != "length" ||
               std::count(model.lengths_m.begin(), model.lengths_m.end(), value) ==
                   static_cast<std::ptrdiff_t>(model.lengths_m.size())) {
      insert.bind(index, value);
    }
    ++index;
  }
}

void add_model_definition(sqlite3* database) {
  constexpr int kArguments = 1;
  const int code = sqlite3_create_function_v2(database, "model_definition", kArguments,
                                              SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr,
                                              model_definition, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) {
    throw StorageError(std::string("models cannot be defined: ") + sqlite3_errmsg(database));
  }
}

}  // namespace oblique::server
