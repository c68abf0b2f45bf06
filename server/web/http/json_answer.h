#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "server/web/http/http_message.h"

// What the page's answers have in common.
namespace oblique::server {

HttpAnswer json_answer(const nlohmann::ordered_json& value, unsigned status = 200);

/// {"error": sentence}
HttpAnswer error_answer(unsigned status, const std::string& sentence);

/// Numbers behind a head that describes them: four bytes with the length of the head, the lowest
/// first; the head, as JSON that ends with spaces so that the numbers begin at a multiple of eight
/// bytes; `numbers`.
HttpAnswer numbers_answer(const nlohmann::ordered_json& head, const std::string& numbers);

}  // namespace oblique::server
