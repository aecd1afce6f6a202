// PUT /v1/uploads/NAME: the body goes to the disk as it comes; the file appears when it is whole. One chunk is in
// memory at a time: the next is read when the disk has taken the last.
#include "server/http/sessions.h"

#include <spdlog/spdlog.h>

#include <boost/asio/write.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/read.hpp>

#include "server/http/http_rules.h"
#include "server/http/upload_store.h"

namespace gonio {
namespace {

constexpr std::size_t kChunkBytes = 64 << 10;
constexpr auto kLinger = std::chrono::seconds(2);  // for the client to read why its upload ends early
constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

// Whether what came breaks HTTP. A client that leaves in the middle, or brings nothing for too long, does not.
bool is_fault_of_body(error_code error) {
    return error.category() == http::make_error_code(http::error::bad_chunk).category() &&
           error != http::error::need_buffer && error != http::error::partial_message &&
           error != http::error::end_of_stream;
}

class UploadSession final : public std::enable_shared_from_this<UploadSession> {
public:
    UploadSession(SessionRegistry& registry, Accepted accepted, beast::flat_buffer buffer,
                  http::request_parser<http::empty_body>&& header, std::string name, std::string token)
        : registry_(registry),
          accepted_(std::move(accepted)),
          buffer_(std::move(buffer)),
          parser_(std::move(header)),
          name_(std::move(name)),
          token_(std::move(token)),
          chunk_(kChunkBytes) {}
    ~UploadSession() {
        // Only where the HTTP server ended in between; the disk thread has ended before.
        if (open_) registry_.options.uploads->abandon(part_);
    }

    void start() {
        const std::uint64_t bytes = parser_.content_length().value_or(0);
        on_disk([this, bytes] { return registry_.options.uploads->begin(name_, bytes); },
                [this](Result<UploadPart> part) {
                    if (!part) return refuse(part.error());
                    part_ = std::move(*part);
                    open_ = true;
                    is_expected();
                });
    }

private:
    // Calls `work` on the disk thread, then `then` with its result on this one.
    template <typename Work, typename Then>
    void on_disk(Work work, Then then) {
        registry_.calls.on_disk([self = shared_from_this(), work, then]() mutable {
            auto result = std::make_shared<decltype(work())>(work());
            const auto executor = self->accepted_.stream.get_executor();
            asio::post(executor, [self = std::move(self), result, then] { then(std::move(*result)); });
        });
    }
    void is_expected() {
        if (!beast::iequals(parser_.get()[http::field::expect], "100-continue")) return read();
        accepted_.stream.expires_after(registry_.options.limits.write_stall);
        asio::async_write(accepted_.stream, asio::buffer(kContinue),
                          [self = shared_from_this()](error_code error, std::size_t) {
                              if (error) return self->abandon();
                              self->read();
                          });
    }
    void read() {
        if (parser_.is_done()) return finish();
        parser_.get().body().data = chunk_.data();
        parser_.get().body().size = chunk_.size();
        accepted_.stream.expires_after(registry_.options.limits.write_stall);
        http::async_read_some(accepted_.stream, buffer_, parser_,
                              [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
    }
    void on_read(error_code error) {
        if (is_fault_of_body(error))
            return refuse({"bad_message", "", name_,
                           "The body is not what its Transfer-Encoding says it is: " + error.message() + "."});
        if (error && error != http::error::need_buffer) return abandon();
        const std::size_t bytes = chunk_.size() - parser_.get().body().size;
        if (bytes == 0) return read();  // the header of a chunk, or its end
        on_disk(
            [this, bytes] {
                return registry_.options.uploads->write(part_, {chunk_.data(), bytes});
            },
            [this](const Result<bool>& written) {
                if (!written) return refuse(written.error());
                if (!parser_.is_done()) return read();
                finish();
            });
    }
    void finish() {
        if (registry_.access.tokens.right_of(token_) != Right::change)
            return refuse({"permission", "", name_, "The token does not hold any more."});
        open_ = false;
        on_disk([this] { return registry_.options.uploads->finish(part_); },
                [this](Result<bool> replaced) {
                    if (!replaced) return refuse(replaced.error());
                    spdlog::info("net: uploaded {} of {} bytes", part_.name, part_.bytes);
                    registry_.options.metrics->counter("uploaded_bytes_total", "Bytes of complete uploads.")
                        .add(part_.bytes);
                    answer(*replaced ? http::status::ok : http::status::created, "application/json",
                           "{\"name\":\"" + part_.name + "\",\"bytes\":" + std::to_string(part_.bytes) + "}\n");
                });
    }
    void abandon() {
        if (!std::exchange(open_, false)) return;
        on_disk(
            [this] {
                registry_.options.uploads->abandon(part_);
                return true;
            },
            [](bool) {});
    }
    void refuse(const Error& error) {
        abandon();
        answer(status_of(error.code), "text/plain; charset=utf-8", error.code + ": " + error.text() + "\n");
    }
    void answer(http::status status, const char* type, const std::string& text) {
        answer_ = "HTTP/1.1 " + std::to_string(static_cast<unsigned>(status)) + " " +
                  std::string(view_of(http::obsolete_reason(status))) + "\r\nContent-Type: " + type +
                  "\r\nContent-Length: " + std::to_string(text.size()) +
                  "\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n" + text;
        registry_.count_answer(static_cast<unsigned>(status));
        accepted_.stream.expires_after(registry_.options.limits.write_stall);
        asio::async_write(accepted_.stream, asio::buffer(answer_),
                          [self = shared_from_this()](error_code error, std::size_t) {
                              if (error) return;
                              self->accepted_.stream.expires_after(kLinger);
                              self->accepted_.stream.async_shut_down([self](error_code) {});
                          });
    }

    SessionRegistry& registry_;
    Accepted accepted_;
    beast::flat_buffer buffer_;
    http::request_parser<http::buffer_body> parser_;
    std::string name_, token_, answer_;
    std::vector<char> chunk_;
    UploadPart part_;
    bool open_ = false;  // part_ is to be finished or abandoned
};

}  // namespace

void start_upload_session(SessionRegistry& registry, Accepted accepted, beast::flat_buffer buffer,
                          http::request_parser<http::empty_body>&& header, std::string name, std::string token) {
    std::make_shared<UploadSession>(registry, std::move(accepted), std::move(buffer), std::move(header),
                                    std::move(name), std::move(token))
        ->start();
}

}  // namespace gonio
