// The front under TLS, against OpenSSL's own client.
#include <openssl/ssl.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "client/connection/connection.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/http/tls.h"
#include "tests/unit/certificate.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

// An HTTPS client that trusts anybody and tells whom it met.
class SecureClient {
public:
    SecureClient(std::uint16_t port, int most_version = TLS1_3_VERSION, const char* ciphers = nullptr) {
        context_ = SSL_CTX_new(TLS_client_method());
        if (ciphers != nullptr) {
            EXPECT_EQ(SSL_CTX_set_cipher_list(context_, ciphers), 1);
        }
        SSL_CTX_set_security_level(context_, 0);  // else it would not even offer what the server is to refuse
        SSL_CTX_set_min_proto_version(context_, TLS1_VERSION);
        SSL_CTX_set_max_proto_version(context_, most_version);
        socket_ = ::socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        const timeval time{5, 0};
        ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
        ssl_ = SSL_new(context_);
        SSL_set_fd(ssl_, socket_);
        connected = SSL_connect(ssl_) == 1;
    }
    ~SecureClient() {
        SSL_free(ssl_);
        SSL_CTX_free(context_);
        ::close(socket_);
    }
    SecureClient(const SecureClient&) = delete;
    SecureClient& operator=(const SecureClient&) = delete;

    std::string get(const std::string& target) {
        const std::string request = "GET " + target + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        SSL_write(ssl_, request.data(), static_cast<int>(request.size()));
        std::string answer;
        char bytes[4096];
        for (int n = 0; (n = SSL_read(ssl_, bytes, sizeof bytes)) > 0;)
            answer.append(bytes, static_cast<std::size_t>(n));
        ended_cleanly = SSL_get_shutdown(ssl_) == SSL_RECEIVED_SHUTDOWN;
        return answer;
    }
    std::string name_of_server() const {
        X509* certificate = SSL_get1_peer_certificate(ssl_);
        if (certificate == nullptr) return "";
        char name[256] = {};
        X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name, sizeof name);
        X509_free(certificate);
        return name;
    }
    // Says goodbye and goes, whatever was asked.
    void leave(const std::string& asked) {
        SSL_write(ssl_, asked.data(), static_cast<int>(asked.size()));
        SSL_shutdown(ssl_);
        ::shutdown(socket_, SHUT_WR);
    }
    bool connected = false, ended_cleanly = false;

private:
    SSL_CTX* context_;
    SSL* ssl_ = nullptr;
    int socket_;
};

struct FrontTlsTest : FrontTest {
    std::string folder;
    FrontTlsTest() {
        std::string pattern = (fs::temp_directory_path() / "gonio-tls-XXXXXX").string();
        folder = mkdtemp(pattern.data());
        EXPECT_TRUE(make_certificate(folder, "first") && make_certificate(folder, "second")) << "openssl(1) is needed";
        use("first");
        options.tls_certificate = folder + "/server.crt";
        options.tls_key = folder + "/server.key";
    }
    ~FrontTlsTest() override {
        front.reset();
        fs::remove_all(folder);
    }
    void use(const std::string& name) const {
        for (const char* ending : {".crt", ".key"})
            fs::copy_file(folder + "/" + name + ending, folder + "/server" + ending,
                          fs::copy_options::overwrite_existing);
    }
    ServerAddress address(const std::string& ca) const {
        auto result = parse_server_url("https://localhost:" + std::to_string(front->port()));
        result->ca_file = folder + "/" + ca + ".crt";
        return *result;
    }
};

// RFC 9325, 4.2: of TLS 1.2 no key exchange by RSA and no CBC.
TEST_F(FrontTlsTest, OfTls12OnlyEphemeralKeysAndAuthenticatedEncryption) {
    start();
    for (const char* refused : {"AES128-GCM-SHA256", "AES256-SHA", "ECDHE-RSA-AES128-SHA", "ECDHE-RSA-AES256-SHA384",
                                "DHE-RSA-AES128-GCM-SHA256"})
        EXPECT_FALSE(SecureClient(front->port(), TLS1_2_VERSION, refused).connected) << refused;
    bool one = false;
    for (const char* taken : {"ECDHE-RSA-AES128-GCM-SHA256", "ECDHE-ECDSA-AES128-GCM-SHA256"})
        one |= SecureClient(front->port(), TLS1_2_VERSION, taken).connected;
    EXPECT_TRUE(one);
}

TEST_F(FrontTlsTest, ServesPagesOverTls) {
    start();
    EXPECT_TRUE(front->secure());
    SecureClient client(front->port());
    ASSERT_TRUE(client.connected);
    const std::string answer = client.get("/");
    EXPECT_EQ(answer.substr(0, 15), "HTTP/1.1 200 OK");
    EXPECT_NE(answer.find(kPage[0].content), std::string::npos);
    EXPECT_TRUE(client.ended_cleanly) << "with close_notify";
    EXPECT_FALSE(SecureClient(front->port(), TLS1_1_VERSION).connected);
    EXPECT_TRUE(SecureClient(front->port(), TLS1_2_VERSION).connected);
}

TEST_F(FrontTlsTest, AStillWhoseClientLeavesIsForgotten) {
    start();
    SecureClient client(front->port());
    client.leave("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(wait_for([&] { return requests.size() == 1 && gone.size() == 1; })) << "its close_notify is not read";
}

TEST_F(FrontTlsTest, PlainHttpIsToldSoAndClosed) {
    options.limits.header = 300ms;
    start();
    Client plain(front->port());
    EXPECT_EQ(plain.get("/healthz"), 400);
    EXPECT_NE(plain.body.find("HTTPS"), std::string::npos);
    EXPECT_TRUE(plain.receive_end());
    Client silent(front->port());
    EXPECT_TRUE(silent.receive_end(2000)) << "nothing in time";
    Client half(front->port());
    half.send("\x16\x03\x01\x02");
    EXPECT_TRUE(half.receive_end(2000)) << "a handshake that stops";
    EXPECT_TRUE(SecureClient(front->port()).connected);
}

TEST_F(FrontTlsTest, ANewCertificateIsShownAndABrokenOneIsRefused) {
    start();
    SecureClient before(front->port());
    EXPECT_EQ(before.name_of_server(), "first");
    use("second");
    const auto loaded = load_tls(options.tls_certificate, options.tls_key);
    ASSERT_TRUE(loaded) << loaded.error().text();
    front->set_tls(*loaded);
    EXPECT_EQ(before.get("/healthz").substr(0, 12), "HTTP/1.1 200") << "connections that stand stay";
    EXPECT_EQ(SecureClient(front->port()).name_of_server(), "second");
    std::ofstream(options.tls_certificate) << "no certificate";
    const auto broken = load_tls(options.tls_certificate, options.tls_key);
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, "bad_certificate");
    EXPECT_EQ(broken.error().where, options.tls_certificate);
    use("first");
    fs::copy_file(folder + "/second.key", options.tls_key, fs::copy_options::overwrite_existing);
    EXPECT_FALSE(load_tls(options.tls_certificate, options.tls_key)) << "a key of another certificate";
}

TEST_F(FrontTlsTest, TheCommandLineVerifiesTheServer) {
    start();
    std::jthread answering([this] {
        if (!wait_for([&] { return !requests.empty(); })) return;
        v1::ServerMessage answer;
        answer.set_request_id(requests[0].second.request_id());
        answer.mutable_stats()->set_clients(7);
        front->reply(requests[0].first, answer);
    });
    auto connection = Connection::open(address("first"), {});
    ASSERT_TRUE(connection) << connection.error().text();
    v1::ClientMessage question;
    question.mutable_stats();
    const auto answer = (*connection)->ask(question, [](const v1::Progress&) {});
    ASSERT_TRUE(answer) << answer.error().text();
    EXPECT_EQ(answer->stats().clients(), 7u);
    const auto other = Connection::open(address("second"), {});
    ASSERT_FALSE(other) << "signed by nobody that is trusted";
    EXPECT_EQ(other.error().code, "untrusted");
    auto elsewhere = address("first");
    elsewhere.host = "127.0.0.2";  // the certificate is not for it
    const auto wrong_name = Connection::open(elsewhere, {});
    EXPECT_FALSE(wrong_name);
}

TEST_F(FrontTlsTest, VideoPassesWholeAndInOrder) {
    start();
    Connection::Wanted wanted;
    wanted.video = true;
    auto connection = Connection::open(address("first"), wanted);
    ASSERT_TRUE(connection) << connection.error().text();
    for (std::uint32_t i = 1; i <= 5; ++i) {
        ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264(); }));
        front->publish_h264(frame(i, i == 1, 100'000), false);  // many records
        const auto event = (*connection)->next();
        ASSERT_TRUE(event);
        EXPECT_EQ(event->header.scene_rev, i);
        EXPECT_EQ(event->access_unit.size(), 100'000u);
        v1::ClientMessage ack;
        ack.mutable_frame_ack()->set_seq(event->header.seq);
        ASSERT_TRUE((*connection)->say(ack));
    }
}

}  // namespace
}  // namespace gonio
