#include "protocol/net/net_stream.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/ssl/stream.hpp>

namespace gonio {
namespace {

// Of one TLS record: what is written at once goes into as few as possible.
constexpr std::size_t kRecordBytes = 16 << 10;

// Result: `moved`, noting in `at` when bytes did.
NetStream::Moved noting(std::chrono::steady_clock::time_point& at, NetStream::Moved moved) {
    return [&at, moved = std::move(moved)](error_code error, std::size_t bytes) {
        if (bytes > 0) at = std::chrono::steady_clock::now();
        moved(error, bytes);
    };
}

}  // namespace

struct NetStream::Impl {
    explicit Impl(tcp::socket socket) : plain(std::move(socket)) {}

    // Reads until the other side ends, or the time or the connection is over.
    void drain(Done done) {
        plain.async_read_some(asio::buffer(drained), [this, done = std::move(done)](error_code error, std::size_t) {
            if (error) return done(error == asio::error::eof ? error_code() : error);
            drain(done);
        });
    }

    void begin_tls(std::shared_ptr<asio::ssl::context> with) {
        context = std::move(with);
        tls = std::make_unique<asio::ssl::stream<beast::tcp_stream&>>(plain, *context);
        record.resize(kRecordBytes);
    }

    beast::tcp_stream plain;
    std::shared_ptr<asio::ssl::context> context;
    std::unique_ptr<asio::ssl::stream<beast::tcp_stream&>> tls;
    std::vector<char> record;  // being written
    std::array<char, 1024> drained{};
    std::chrono::steady_clock::time_point wrote{}, read{};
};

NetStream::NetStream(tcp::socket socket) : impl_(std::make_unique<Impl>(std::move(socket))) {}
NetStream::~NetStream() = default;
NetStream::NetStream(NetStream&&) noexcept = default;
NetStream& NetStream::operator=(NetStream&&) noexcept = default;

std::chrono::steady_clock::time_point NetStream::last_written() const {
    return impl_->wrote;
}

std::chrono::steady_clock::time_point NetStream::last_read() const {
    return impl_->read;
}

NetStream::executor_type NetStream::get_executor() noexcept {
    return impl_->plain.get_executor();
}
tcp::socket& NetStream::socket() {
    return impl_->plain.socket();
}
void NetStream::expires_after(std::chrono::nanoseconds time) {
    impl_->plain.expires_after(time);
}
void NetStream::expires_never() {
    impl_->plain.expires_never();
}
bool NetStream::peer_has_gone() const {
    tcp_info info{};
    socklen_t size = sizeof info;
    const int fd = impl_->plain.socket().native_handle();
    return ::getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 && info.tcpi_state != TCP_ESTABLISHED;
}
void NetStream::close() {
    impl_->plain.close();
}

void NetStream::async_accept_tls(std::shared_ptr<asio::ssl::context> tls, Done done) {
    impl_->begin_tls(std::move(tls));
    impl_->tls->async_handshake(asio::ssl::stream_base::server, std::move(done));
}

void NetStream::async_connect_tls(std::shared_ptr<asio::ssl::context> tls, const std::string& host, Done done) {
    impl_->begin_tls(std::move(tls));
    impl_->tls->set_verify_mode(asio::ssl::verify_peer);
    impl_->tls->set_verify_callback(asio::ssl::host_name_verification(host));
    error_code is_name;
    asio::ip::make_address(host, is_name);
    if (is_name) SSL_set_tlsext_host_name(impl_->tls->native_handle(), host.c_str());  // never addresses: RFC 6066, 3
    impl_->tls->async_handshake(asio::ssl::stream_base::client, std::move(done));
}

std::string NetStream::distrust() const {
    if (!impl_->tls) return "";
    const long verified = SSL_get_verify_result(impl_->tls->native_handle());
    if (verified == X509_V_OK) return "";
    // OpenSSL has no reason of its own for a certificate that host_name_verification() refuses.
    return verified == X509_V_ERR_UNSPECIFIED ? "it is of another name" : X509_verify_cert_error_string(verified);
}

void NetStream::async_shut_down(Done done) {
    const auto end = [impl = impl_.get(), done = std::move(done)] {
        error_code ignored;
        impl->plain.socket().shutdown(tcp::socket::shutdown_send, ignored);
        impl->drain(done);
    };
    if (!impl_->tls) return end();
    impl_->tls->async_shutdown([end](error_code) { end(); });
}

void NetStream::read_some(const Buffers<asio::mutable_buffer>& buffers, Moved moved) {
    Moved noted = noting(impl_->read, std::move(moved));
    if (impl_->tls) return impl_->tls->async_read_some(buffers[0], std::move(noted));
    impl_->plain.async_read_some(buffers, std::move(noted));
}

void NetStream::write_some(const Buffers<asio::const_buffer>& buffers, Moved moved) {
    Moved noted = noting(impl_->wrote, std::move(moved));
    if (!impl_->tls) return impl_->plain.async_write_some(buffers, std::move(noted));
    const std::size_t bytes = asio::buffer_copy(asio::buffer(impl_->record), buffers);
    impl_->tls->async_write_some(asio::buffer(impl_->record.data(), bytes), std::move(noted));
}

void teardown(beast::role_type, NetStream& stream, error_code& error) {
    stream.socket().shutdown(tcp::socket::shutdown_send, error);
}

void beast_close_socket(NetStream& stream) {
    stream.close();
}

}  // namespace gonio
