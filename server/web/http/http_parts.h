#pragma once

#include <microhttpd.h>

#include "server/web/http/http_message.h"
#include "server/web/http/request_rules.h"

// Between the library's requests and responses and ours.
namespace oblique::server {

/// A request as it comes in.
struct Asked {
  RequestHead head;
  HttpQuestion question;
};

/// What the library has of a request whose head has come.
Asked asked_on(MHD_Connection* connection, const char* method, const char* path);

/// A response with a copy of the body; null: there is no memory.
MHD_Response* buffered(const HttpAnswer& answer);
/// Adds the headers of all answers, and those of this one.
void add_headers(MHD_Response* response, const HttpAnswer& answer);

}  // namespace oblique::server
