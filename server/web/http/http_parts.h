#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <microhttpd.h>

#include "server/network/listener.h"
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

/// A response with that body; null: there is no memory.
MHD_Response* buffered(std::string body);
/// Adds the headers of all answers, and those of this one.
void add_headers(MHD_Response* response, const HttpAnswer& answer);

/// To who has not asked yet; nothing of an answer is under way then.
inline constexpr std::string_view kTooSlow =
    "HTTP/1.1 408 Request Timeout\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
inline constexpr std::string_view kCrowded =
    "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nConnection: close\r\n"
    "Content-Length: 0\r\n\r\n";

/// Without the port; of IPv4 also where it came by an IPv6 socket.
std::string host_of(const PeerAddress& address);

/// Of each connection, -1 being none, whether its peer will take nothing more. The rule is that of
/// browsers: who has ended its own half has gone.
std::vector<bool> who_is_gone(const std::vector<int>& descriptors);

}  // namespace oblique::server
