// Files that are sent to the server, over HTTP.

#include "client/connection/link.h"

#include <boost/beast/http/file_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>

namespace gonio {

Result<bool> upload(const ServerAddress& address, const std::string& token, const std::string& file,
                    const std::string& name) {
    http::request<http::file_body> request(http::verb::put, "/v1/uploads/" + name, 11);
    request.set(http::field::host, address.host_header());
    if (!token.empty()) request.set(http::field::authorization, "Bearer " + token);
    error_code error;
    request.body().open(file.c_str(), beast::file_mode::scan, error);
    if (error) return Error{"file_unreadable", "load scene", file, "The file cannot be read."};
    request.prepare_payload();
    Link link;
    Result<NetStream> stream = link.connect(address);
    if (!stream) return stream.error();
    error = link.run(kForever, *stream, [&](const NetStream::Done& done) {
        http::async_write(*stream, request, [done](error_code e, std::size_t) { done(e); });
    });
    // Where the server refuses early, its answer says why.
    http::response<http::string_body> response;
    beast::flat_buffer buffer;
    const error_code answered = link.run(kReplyTime, *stream, [&](const NetStream::Done& done) {
        http::async_read(*stream, buffer, response, [done](error_code e, std::size_t) { done(e); });
    });
    if (answered)
        return Error{"unreachable", "", address.host_header(),
                     "The upload broke off: " + (error ? error : answered).message() + "."};
    if (response.result() == http::status::ok || response.result() == http::status::created) return true;
    std::string said = response.body().substr(0, 300);
    while (!said.empty() && said.back() == '\n') said.pop_back();
    return Error{"refused", "HTTP " + std::to_string(response.result_int()), name, said};
}

}  // namespace gonio
