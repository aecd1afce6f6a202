// The begin of a connection on the HTTPS port.
#include "server/http/sessions.h"

#include <boost/asio/write.hpp>
#include <string_view>

#include "server/http/tls_context.h"

namespace gonio {
namespace {

constexpr unsigned char kHandshakeRecord = 22;  // RFC 8446, 5.1: ContentType of a ClientHello
constexpr std::string_view kPlainAnswer =
    "HTTP/1.1 400 Bad Request\r\n"
    "Content-Type: text/plain; charset=utf-8\r\n"
    "Content-Length: 40\r\n"
    "Connection: close\r\n"
    "\r\n"
    "This port speaks HTTPS, not plain HTTP.\n";

class SecureStart final : public std::enable_shared_from_this<SecureStart> {
public:
    SecureStart(SessionRegistry& registry, Accepted accepted)
        : registry_(registry), accepted_(std::move(accepted)), timer_(accepted_.stream.get_executor()) {}

    void start() {
        timer_.expires_after(registry_.options.limits.header);
        timer_.async_wait([self = shared_from_this()](error_code error) {
            if (!error && !self->handed_over_) self->accepted_.stream.close();
        });
        accepted_.stream.socket().async_wait(
            tcp::socket::wait_read, [self = shared_from_this()](error_code error) { self->on_readable(error); });
    }

private:
    void on_readable(error_code error) {
        unsigned char first = 0;
        if (error || ::recv(accepted_.stream.socket().native_handle(), &first, 1, MSG_PEEK | MSG_DONTWAIT) != 1)
            return end();
        if (first != kHandshakeRecord) {
            return asio::async_write(accepted_.stream, asio::buffer(kPlainAnswer),
                                     [self = shared_from_this()](error_code failed, std::size_t) {
                                         if (failed) return self->end();
                                         self->accepted_.stream.async_shut_down([self](error_code) { self->end(); });
                                     });
        }
        const std::shared_ptr<TlsContext> tls = registry_.access.tls;
        accepted_.stream.async_accept_tls({tls, &tls->context}, [self = shared_from_this()](error_code failed) {
            self->timer_.cancel();
            if (self->registry_.stopping) return;
            self->handed_over_ = true;
            if (!failed) return start_http_session(self->registry_, std::move(self->accepted_));
            self->registry_.options.metrics->counter("tls_failures_total", "TLS handshakes that failed.").add();
        });
    }
    void end() { timer_.cancel(); }  // the connection closes with the last handler

    SessionRegistry& registry_;
    Accepted accepted_;
    asio::steady_timer timer_;
    bool handed_over_ = false;
};

}  // namespace

void start_secure_session(SessionRegistry& registry, Accepted accepted) {
    std::make_shared<SecureStart>(registry, std::move(accepted))->start();
}

}  // namespace gonio
