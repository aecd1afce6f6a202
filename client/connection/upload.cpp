// Files that are sent to the server, over HTTP.

#include "client/connection/link.h"

#include <boost/beast/http/file_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>

namespace gonio {

// Result: a segment of a path; RFC 3986, 2.1 and 2.3.
static std::string percent_encoded(const std::string& text) {
    constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    constexpr char kDigits[] = "0123456789ABCDEF";
    std::string encoded;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (kPlain.find(c) != kPlain.npos)
            encoded += c;
        else
            encoded.append({'%', kDigits[byte >> 4], kDigits[byte & 15]});
    }
    return encoded;
}

Result<bool> upload(const ServerAddress& address, const std::string& token, const std::string& file,
                    const std::string& name) {
    http::request<http::file_body> request(http::verb::put, "/v1/uploads/" + percent_encoded(name), 11);
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
