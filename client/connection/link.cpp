#include "client/connection/link.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ssl/context.hpp>
#include <optional>

namespace gonio {

error_code Link::run(std::chrono::steady_clock::duration time, NetStream& stream,
                     const std::function<void(NetStream::Done)>& start) {
    std::optional<error_code> result;
    start([&result](error_code error) { result = error; });
    context_.restart();
    const auto deadline = std::chrono::steady_clock::now() + time;
    while (!result && context_.run_one_until(deadline) > 0) {
    }  // a read may be on its way beside it
    if (result) return *result;
    stream.close();
    context_.restart();
    context_.run_for(std::chrono::seconds(1));
    return beast::error::timeout;
}

Result<NetStream> Link::connect(const ServerAddress& address) {
    const auto unreachable = [&](const error_code& error) {
        return Error{"unreachable", "", address.host_header(),
                     "The server cannot be reached: " + error.message() + "."};
    };
    error_code error;
    std::shared_ptr<asio::ssl::context> tls;
    if (address.secure) {
        tls = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_client);
        if (address.ca_file.empty())
            tls->set_default_verify_paths(error);
        else
            tls->load_verify_file(address.ca_file, error);
        if (error) return Error{"file_unreadable", "authorities", address.ca_file, "The certificates cannot be read."};
        SSL_CTX_set_min_proto_version(tls->native_handle(), TLS1_2_VERSION);
    }
    NetStream stream{tcp::socket(context_)};
    tcp::resolver resolver(context_);
    tcp::resolver::results_type endpoints;
    error = run(kConnectTime, stream, [&](const NetStream::Done& done) {
        resolver.async_resolve(address.host, address.port, [&endpoints, done](error_code e, auto found) {
            endpoints = std::move(found);
            done(e);
        });
    });
    if (!error)
        error = run(kConnectTime, stream, [&](const NetStream::Done& done) {
            asio::async_connect(stream.socket(), endpoints, [done](error_code e, const auto&) { done(e); });
        });
    if (error) return unreachable(error);
    error_code ignored;
    stream.socket().set_option(tcp::no_delay(true), ignored);
    if (!tls) return stream;
    error = run(kConnectTime, stream,
                [&](NetStream::Done done) { stream.async_connect_tls(tls, address.host, std::move(done)); });
    if (!error) return stream;
    if (const std::string why = stream.distrust(); !why.empty())
        return Error{"untrusted", "", address.host_header(),
                     "The server's certificate is not trusted: " + why +
                         "; --ca (--follow-ca of goniod) names a file of authorities."};
    return unreachable(error);
}

void Link::poll() {
    context_.restart();
    context_.poll();
}

}  // namespace gonio
