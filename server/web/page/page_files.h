#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "server/web/http/http_message.h"

namespace oblique::server {

/// A file of the page, from `client/web`.
struct PageFile {
  std::string_view path;  ///< as it is asked for: /overview.js
  std::string_view content_type;
  std::string_view tag;  ///< ETag, in its quotes
  std::span<const unsigned char> gzipped;
};

/// All of them, made by the build.
std::span<const PageFile> page_files();

/// Whether there is a file at that path, / being the page itself.
bool is_page_file(std::string_view path);

/// The file that is asked for; 304 where the browser has it. Nothing:
/// there is no such file.
std::optional<HttpAnswer> file_answer(const HttpQuestion& question);

}  // namespace oblique::server
