// A TCP connection, plain or under TLS, as one type: what speaks over it is written, and compiled, once, for the server
// and its clients. It meets Asio's AsyncStream and what Beast's WebSocket asks of its next layer. Handlers run on the
// connection's io_context.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "protocol/net/beast.h"

namespace boost::asio::ssl {
class context;
}

namespace gonio {

class NetStream {
public:
    using executor_type = beast::tcp_stream::executor_type;
    using Done = std::function<void(error_code)>;
    using Moved = std::function<void(error_code, std::size_t)>;

    explicit NetStream(tcp::socket socket);
    ~NetStream();
    NetStream(NetStream&&) noexcept;
    NetStream& operator=(NetStream&&) noexcept;

    executor_type get_executor() noexcept;
    tcp::socket& socket();
    // When the other side last took something, as far as its window and this machine's buffer tell; never: the epoch.
    std::chrono::steady_clock::time_point last_written() const;
    // When bytes came from it, also of a message that is not whole; never: the epoch.
    std::chrono::steady_clock::time_point last_read() const;
    // Of operations that begin from now on: they end with beast::error::timeout.
    void expires_after(std::chrono::nanoseconds time);
    void expires_never();
    void close();
    // Whether the other side has ended or reset the connection, also where what it sent before was not read.
    bool peer_has_gone() const;
    // The server's part of the TLS handshake; all that follows is encrypted.
    void async_accept_tls(std::shared_ptr<asio::ssl::context> tls, Done done);
    // The client's part. The other side has to prove with its certificate that it is `host`, a name or an address.
    void async_connect_tls(std::shared_ptr<asio::ssl::context> tls, const std::string& host, Done done);
    // Result: why the other side's certificate was not accepted; empty: it was, or none was asked for.
    std::string distrust() const;
    // Says that nothing follows (close_notify, FIN), and reads away what the other side still sends until it ends too.
    // Closing at once would reset the connection before the other side has read everything.
    void async_shut_down(Done done);

    template <typename Buffers, typename Handler>
    void async_read_some(const Buffers& buffers, Handler&& handler) {
        read_some(first<asio::mutable_buffer>(buffers), shared(std::forward<Handler>(handler)));
    }
    template <typename Buffers, typename Handler>
    void async_write_some(const Buffers& buffers, Handler&& handler) {
        write_some(first<asio::const_buffer>(buffers), shared(std::forward<Handler>(handler)));
    }

    static constexpr std::size_t kMostBuffers = 8;  // moved at once; the rest is left for the next call
    template <typename Buffer>
    using Buffers = std::array<Buffer, kMostBuffers>;

private:
    template <typename Buffer, typename Sequence>
    static Buffers<Buffer> first(const Sequence& sequence) {
        Buffers<Buffer> result{};
        std::size_t count = 0;
        for (auto at = asio::buffer_sequence_begin(sequence);
             at != asio::buffer_sequence_end(sequence) && count < kMostBuffers; ++at) {
            const Buffer buffer(*at);
            if (buffer.size() > 0) result[count++] = buffer;
        }
        return result;
    }
    // Beast's handlers can be moved only; what is erased must be copied.
    template <typename Handler>
    static Moved shared(Handler&& handler) {
        auto kept = std::make_shared<std::decay_t<Handler>>(std::forward<Handler>(handler));
        return [kept](error_code error, std::size_t bytes) { std::move (*kept)(error, bytes); };
    }
    void read_some(const Buffers<asio::mutable_buffer>& buffers, Moved moved);
    void write_some(const Buffers<asio::const_buffer>& buffers, Moved moved);

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// Beast finds these by the argument's namespace.
template <typename Handler>
void async_teardown(beast::role_type, NetStream& stream, Handler&& handler) {
    auto kept = std::make_shared<std::decay_t<Handler>>(std::forward<Handler>(handler));
    stream.async_shut_down([kept](error_code error) { std::move (*kept)(error); });
}
void teardown(beast::role_type, NetStream& stream, error_code& error);
void beast_close_socket(NetStream& stream);

}  // namespace gonio
