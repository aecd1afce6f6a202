// Files that are got from the server, over HTTP.

#include "client/connection/link.h"

#include <array>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>

namespace gonio {
namespace {

constexpr auto kPartTime = std::chrono::seconds(20);  // without a byte; then it is given up

}  // namespace

Result<bool> fetch(const ServerAddress& address, const std::string& token, const std::string& path,
                   std::uint64_t most_bytes, const std::function<bool(std::string_view)>& take) {
    http::request<http::empty_body> request(http::verb::get, path, 11);
    request.set(http::field::host, address.host_header());
    if (!token.empty()) request.set(http::field::authorization, "Bearer " + token);
    request.keep_alive(false);
    Link link;
    Result<NetStream> stream = link.connect(address);
    if (!stream) return stream.error();
    const auto broken = [&](const error_code& error) {
        return Error{"unreachable", path, address.host_header(), "The transfer broke off: " + error.message() + "."};
    };
    error_code error = link.run(kPartTime, *stream, [&](const NetStream::Done& done) {
        http::async_write(*stream, request, [done](error_code e, std::size_t) { done(e); });
    });
    if (error) return broken(error);
    http::response_parser<http::buffer_body> parser;
    parser.body_limit(boost::none);
    beast::flat_buffer buffer;
    error = link.run(kPartTime, *stream, [&](const NetStream::Done& done) {
        http::async_read_header(*stream, buffer, parser, [done](error_code e, std::size_t) { done(e); });
    });
    if (error) return broken(error);
    if (parser.get().result() != http::status::ok)
        return Error{"refused", "HTTP " + std::to_string(parser.get().result_int()), path,
                     "The server does not give it: it may have changed there since it was loaded."};
    std::array<char, 1 << 16> chunk;
    std::uint64_t bytes = 0;
    while (!parser.is_done()) {
        parser.get().body().data = chunk.data();
        parser.get().body().size = chunk.size();
        error = link.run(kPartTime, *stream, [&](const NetStream::Done& done) {
            http::async_read(*stream, buffer, parser, [done](error_code e, std::size_t) { done(e); });
        });
        if (error && error != http::error::need_buffer) return broken(error);
        const std::size_t got = chunk.size() - parser.get().body().size;
        bytes += got;
        if (bytes > most_bytes)
            return Error{"too_large", path, std::to_string(bytes) + " bytes",
                         "It may have at most " + std::to_string(most_bytes) + "."};
        if (!take({chunk.data(), got})) return Error{"given_up", path, "", "The transfer was given up."};
    }
    return true;
}

}  // namespace gonio
