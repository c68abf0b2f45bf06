#include "server/web/page/page_files.h"

#include <algorithm>

namespace oblique::server {
namespace {}  // namespace

std::optional<HttpAnswer> file_answer(const HttpRequest& request) {
  const auto files = page_files();
  const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& one) {
    return one.path == (request.path == "/" ? "/index.html" : request.path);
  });
  if (file == files.end()) {
    return std::nullopt;
  }
  // The browser keeps the file, and asks each time whether it has changed.
  HttpAnswer answer{MHD_HTTP_OK,
                    std::string(file->content_type),
                    {},
                    {{"ETag", std::string(file->tag)},
                     {"Cache-Control", "no-cache"},
                     {"Content-Encoding", "gzip"}}};
  if (request.header("if-none-match").find(file->tag) != std::string::npos) {
    answer.status = MHD_HTTP_NOT_MODIFIED;
  } else {
    answer.body.assign(file->gzipped.begin(), file->gzipped.end());
  }
  return answer;
}

}  // namespace oblique::server
