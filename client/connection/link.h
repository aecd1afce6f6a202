// A connection to goniod's port, plain or under TLS; the caller waits for each operation. Only for .cpp files.
#pragma once

#if !defined(BOOST_ASIO_SEPARATE_COMPILATION) || !defined(BOOST_BEAST_SEPARATE_COMPILATION)
#error "Link gonio_beast: else the library is compiled twice, differently."
#endif

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <optional>

#include "client/connection/connection.h"

namespace gonio {

namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::system::error_code;
using PlainStream = beast::tcp_stream;
using SecureStream = beast::ssl_stream<beast::tcp_stream>;

inline constexpr auto kConnectTime = std::chrono::seconds(5);
inline constexpr auto kReplyTime = std::chrono::seconds(120);
inline constexpr auto kForever = std::chrono::hours(24 * 365);

template <typename Stream>
class Link {
public:
    static constexpr bool kSecure = std::is_same_v<Stream, SecureStream>;

    // Result: what a Stream, or a WebSocket of one, is made from.
    auto arguments() {
        if constexpr (kSecure)
            return std::tuple<asio::io_context&, asio::ssl::context&>(context_, tls_);
        else
            return std::tuple<asio::io_context&>(context_);
    }

    // Starts an operation and waits until it is done; after `time` the connection is closed, which ends the operation.
    template <typename Lowest, typename Start>
    error_code run(std::chrono::steady_clock::duration time, Lowest& lowest, const Start& start) {
        std::optional<error_code> result;
        start([&result](error_code error) { result = error; });
        context_.restart();
        const auto deadline = std::chrono::steady_clock::now() + time;
        while (!result && context_.run_one_until(deadline) > 0) {
        }  // a read may be on its way beside it
        if (result) return *result;
        lowest.close();
        context_.restart();
        context_.run_for(std::chrono::seconds(1));
        return beast::error::timeout;
    }

    // Finds the server, connects, and shakes hands. Errors: "unreachable"; "untrusted": its certificate is
    // not from an authority that is known here, or of another name.
    Result<bool> connect(const ServerAddress& address, Stream& stream) {
        beast::tcp_stream& lowest = beast::get_lowest_layer(stream);
        const auto unreachable = [&](const error_code& error) {
            return Error{"unreachable", "", address.host_header(),
                         "The server cannot be reached: " + error.message() + "."};
        };
        if constexpr (kSecure) {
            error_code error;
            if (address.ca_file.empty())
                tls_.set_default_verify_paths(error);
            else
                tls_.load_verify_file(address.ca_file, error);
            if (error)
                return Error{"file_unreadable", "authorities", address.ca_file, "The certificates cannot be read."};
            SSL_set_min_proto_version(stream.native_handle(), TLS1_2_VERSION);
            stream.set_verify_mode(asio::ssl::verify_peer);
            stream.set_verify_callback(asio::ssl::host_name_verification(address.host));
            error_code literal;
            asio::ip::make_address(address.host, literal);
            if (literal)
                SSL_set_tlsext_host_name(stream.native_handle(), address.host.c_str());  // names only: RFC 6066, 3
        }
        asio::ip::tcp::resolver resolver(context_);
        asio::ip::tcp::resolver::results_type endpoints;
        error_code error = run(kConnectTime, lowest, [&](auto done) {
            resolver.async_resolve(address.host, address.port, [&endpoints, done](error_code e, auto found) {
                endpoints = std::move(found);
                done(e);
            });
        });
        if (!error)
            error = run(kConnectTime, lowest, [&](auto done) {
                asio::async_connect(lowest.socket(), endpoints, [done](error_code e, const auto&) { done(e); });
            });
        if (error) return unreachable(error);
        error_code ignored;
        lowest.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
        if constexpr (kSecure) {
            error = run(kConnectTime, lowest, [&](auto done) {
                stream.async_handshake(asio::ssl::stream_base::client, [done](error_code e) { done(e); });
            });
            const long verified = SSL_get_verify_result(stream.native_handle());
            if (error && verified != X509_V_OK) {
                const char* why = verified == X509_V_ERR_UNSPECIFIED ? "it is of another name"  // of ours, above
                                                                     : X509_verify_cert_error_string(verified);
                return Error{"untrusted", "", address.host_header(),
                             std::string("The server's certificate is not trusted: ") + why +
                                 "; --ca (--follow-ca of goniod) names a file of authorities."};
            }
            if (error) return unreachable(error);
        }
        return true;
    }

    // Does what can be done without waiting.
    void poll() {
        context_.restart();
        context_.poll();
    }

private:
    asio::io_context context_;
    asio::ssl::context tls_{asio::ssl::context::tls_client};
};

}  // namespace gonio
