// What the front answers to plain HTTP.
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "server/http/http_rules.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
using namespace std::chrono_literals;

v1::ServerMessage png(const std::string& image, std::uint32_t scene_rev = 0) {
    v1::ServerMessage answer;
    answer.mutable_capture()->set_format("png");
    answer.mutable_capture()->set_image(image);
    answer.mutable_capture()->set_scene_rev(scene_rev);
    return answer;
}

TEST_F(FrontTest, ServesHealthAndPage) {
    start();
    Client client(front->port());
    EXPECT_EQ(client.get("/healthz"), 200);
    EXPECT_EQ(client.body, "ok\n");
    EXPECT_EQ(client.get("/"), 200);  // the same connection
    EXPECT_EQ(client.body, kPage[0].content);
    EXPECT_NE(client.head.find("Content-Type: text/html; charset=utf-8\r\n"), std::string::npos);
    EXPECT_NE(client.head.find("X-Content-Type-Options: nosniff\r\n"), std::string::npos);
    EXPECT_NE(client.head.find("Cache-Control: no-store\r\n"), std::string::npos);
    EXPECT_NE(client.head.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
    EXPECT_EQ(client.get("/main.js"), 200);
    EXPECT_NE(client.head.find("Content-Type: text/javascript"), std::string::npos);
    EXPECT_EQ(client.get("/lib/style.css?v=1"), 200);
    EXPECT_EQ(client.get("/nothing"), 404);
    EXPECT_EQ(client.get("/../etc/passwd"), 404);
    EXPECT_EQ(client.get("/", "", "", "HEAD"), 200);
    EXPECT_NE(client.head.find("Content-Length: " + std::to_string(kPage[0].content.size())), std::string::npos);
    EXPECT_EQ(client.get("/", "", "", "POST"), 405);
}

TEST(HttpRules, UnderTlsAPlainPageIsAnotherOrigin) {
    HttpOptions options;
    EXPECT_TRUE(allowed_origin("http://studio:8080", "studio:8080", options));
    EXPECT_TRUE(allowed_origin("https://studio:8080", "studio:8080", options)) << "a proxy has the certificate";
    options.tls_certificate = "certificate.pem";
    EXPECT_FALSE(allowed_origin("http://studio:8080", "studio:8080", options));
    EXPECT_TRUE(allowed_origin("https://studio:8080", "studio:8080", options));
    options.origins = {"http://studio:8080"};
    EXPECT_TRUE(allowed_origin("http://studio:8080", "studio:8080", options)) << "where somebody says so";
}

TEST_F(FrontTest, ForeignHostsAndOriginsAreRefused) {
    start();
    const std::string port = std::to_string(front->port());
    const std::string good_hosts[] = {"localhost:" + port, "LOCALHOST", "127.0.0.1:9", "[::1]:" + port, "127.8.8.8"};
    for (const std::string& good : good_hosts) EXPECT_EQ(Client(front->port()).get("/healthz", "", good), 200) << good;
    for (const char* bad : {"evil.example", "evil.example:8080", "10.1.2.3", "localhost.evil.example", "["})
        EXPECT_EQ(Client(front->port()).get("/healthz", "", bad), 403) << bad;
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson, "", "evil.example"), 403);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson, "Origin: http://evil.example\r\n"), 403);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson, "Origin: null\r\n"), 403);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson, "Origin: http://127.0.0.1:" + port + "\r\n"), 101);
    Client nameless(front->port());
    nameless.send("GET /healthz HTTP/1.1\r\n\r\n");
    EXPECT_EQ(nameless.read_response(), 400);
}

TEST_F(FrontTest, RefusalsTellCodeAndValue) {
    start();
    Client client(front->port());
    EXPECT_EQ(client.get("/no%20page"), 404);
    EXPECT_EQ(client.body, "not_found: There is no such page. (/no page)\n");
    EXPECT_EQ(client.get("/" + std::string(1000, 'x')), 404);
    EXPECT_LT(client.body.size(), 200u) << client.body;
    EXPECT_EQ(client.get("/", "", "evil.example"), 403);
    EXPECT_EQ(client.body, "permission: This server does not go by that name. (Host: evil.example)\n");
    EXPECT_EQ(client.get("/", "", "a\xff;b.localhost"), 403);
    EXPECT_EQ(client.body, "permission: This server does not go by that name. (Host: a?;b.localhost)\n");
    EXPECT_EQ(client.get("/", "Origin: http://evil.example\r\n"), 403);
    EXPECT_EQ(client.body,
              "permission: Pages of another origin may not use this server. (Origin: http://evil.example)\n");
}

TEST_F(FrontTest, BadRequestsAreAnsweredAndClosed) {
    options.limits.header = 300ms;
    start();
    Client garbage(front->port());
    garbage.send("\x16\x03\x01 hello\r\n\r\n");
    EXPECT_EQ(garbage.read_response(), 400);
    EXPECT_TRUE(garbage.receive_end());
    Client wide(front->port());
    wide.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(9000, 'x') + "\r\n\r\n");
    EXPECT_EQ(wide.read_response(), 431);
    Client slow(front->port());
    slow.send("GET / HTTP/1.1\r\nHost: loc");
    EXPECT_TRUE(slow.receive_end(1500));  // without a header in time there is no answer
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

TEST_F(FrontTest, AnAddressInUseIsAnError) {
    start();
    HttpOptions second = options;
    second.port = front->port();
    auto result = HttpServer::start(second, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, "listen_failed");
    EXPECT_NE(result.error().value.find(std::to_string(front->port())), std::string::npos);
}

TEST_F(FrontTest, StillsAreCaptureQueries) {
    start();
    Client client(front->port());
    client.send("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    ASSERT_TRUE(requests[0].second.has_capture());
    EXPECT_EQ(requests[0].second.capture().format(), "png");
    front->reply(requests[0].first, png("PNGBYTES", 9));
    EXPECT_EQ(client.read_response(), 200);
    EXPECT_EQ(client.body, "PNGBYTES");
    EXPECT_NE(client.head.find("Content-Type: image/png"), std::string::npos);
    EXPECT_NE(client.head.find("X-Scene-Rev: 9"), std::string::npos);

    client.send("GET /v1/frame.jpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 2; }));
    v1::ServerMessage refusal;
    refusal.mutable_result()->set_code("internal");
    front->reply(requests[1].first, refusal);
    EXPECT_EQ(client.read_response(), 500);

    accept_requests = false;
    EXPECT_EQ(client.get("/v1/frame.jpg"), 503);
}

TEST_F(FrontTest, AStillThatDoesNotComeIs504) {
    options.limits.still = 100ms;
    start();
    EXPECT_EQ(Client(front->port()).get("/v1/frame.jpg"), 504);
}

TEST_F(FrontTest, AStillWhoseClientLeavesIsForgottenAlsoBehindWhatItSentBefore) {
    start();
    for (const char* behind : {"", "GET /healthz HTTP/1.1\r\n"}) {
        Client(front->port()).send(std::string("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n") + behind);
        ASSERT_TRUE(wait_for([&] { return !requests.empty() && gone.size() == requests.size(); })) << behind;
    }
    Client patient(front->port());
    patient.send(
        "GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 3; }));
    std::this_thread::sleep_for(700ms);
    front->reply(requests[2].first, png("PNGBYTES", 9));
    EXPECT_EQ(patient.read_response(), 200);
    EXPECT_EQ(patient.read_response(), 200) << "the next request";
    EXPECT_EQ(patient.body, "ok\n");
}

TEST_F(FrontTest, PagesElsewhereShowNoPictures) {
    options.limits.still = 50ms;
    start();
    Client client(front->port());
    const auto asked = [&](const char* site, const char* destination) {
        return client.get("/v1/frame.png",
                          std::string("Sec-Fetch-Site: ") + site + "\r\nSec-Fetch-Dest: " + destination + "\r\n");
    };
    EXPECT_EQ(asked("cross-site", "image"), 403);
    EXPECT_EQ(asked("same-site", "image"), 403) << "another port of the same host";
    EXPECT_EQ(asked("cross-site", "iframe"), 403);
    EXPECT_EQ(client.get("/v1/mjpeg", "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: image\r\n"), 403);
    EXPECT_EQ(asked("same-origin", "image"), 504) << "the page's own";
    EXPECT_EQ(asked("cross-site", "document"), 504) << "a link that somebody followed";
    EXPECT_EQ(asked("none", "document"), 504) << "an address that somebody typed";
    EXPECT_EQ(asked("cross-site", "document\r\nSec-Purpose: prefetch;prerender"), 403) << "ahead of a click";
    EXPECT_EQ(asked("cross-site", "image\r\nReferer: https://listed.example/"), 403);
    EXPECT_EQ(client.body.substr(0, 12), "permission: ");
    front.reset();
    options.origins = {"https://listed.example"};
    start();
    Client listed(front->port());
    const std::string from = "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: image\r\nReferer: https://";
    EXPECT_EQ(listed.get("/v1/frame.png", from + "listed.example/page\r\n"), 504);
    EXPECT_EQ(listed.get("/v1/frame.png", from + "unlisted.example/page\r\n"), 403);
    EXPECT_EQ(listed.get("/v1/frame.png", from + "listed.example.evil/\r\n"), 403);
}

TEST_F(FrontTest, AStillThatWaitsAtTheEndIs503) {
    start();
    Client client(front->port());
    client.send("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    front.reset();
    EXPECT_EQ(client.read_response(), 503);
    EXPECT_NE(client.head.find("Connection: close"), std::string::npos) << client.head;
    EXPECT_TRUE(client.receive_end());
}

TEST_F(FrontTest, MjpegSendsTheNextPartsHeaderAtOnce) {
    start();
    Client client(front->port());
    client.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(client.receive_until("--gonio-frame\r\nContent-Type: image/jpeg\r\n\r\n"));
    EXPECT_NE(client.received.find("multipart/x-mixed-replace;boundary=gonio-frame"), std::string::npos);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.jpeg && d.clients == 1; }));
    client.received.clear();
    EncodedFrame picture = frame(5, true, 4);
    front->publish_jpeg(picture);
    // The whole part and the header of the one after it, though that one does not exist yet.
    EXPECT_TRUE(client.receive_until("eeee\r\n--gonio-frame\r\nContent-Type: image/jpeg\r\n\r\n"));
    client.received.clear();
    EXPECT_EQ(front->packets_sent(), 1u);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.jpeg; }));
    front->publish_jpeg(picture);  // the same picture again, encoded for somebody else
    // One that comes later gets the picture that the others have.
    Client second(front->port());
    second.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(second.receive_until("eeee\r\n--gonio-frame\r\n"));
    EXPECT_FALSE(client.receive(50));
    EXPECT_EQ(front->packets_sent(), 2u);
}

TEST_F(FrontTest, AnMjpegClientThatLeavesIsForgotten) {
    start();
    {
        Client client(front->port());
        client.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n");
        ASSERT_TRUE(wait_demand([](const Demand& d) { return d.jpeg; }));
    }
    EXPECT_TRUE(wait_demand([](const Demand& d) { return !d.jpeg && d.clients == 0; }));
}

// The time of a write is that without any progress.
TEST_F(FrontTest, WhoeverReadsSlowlyGetsAllOfAStill) {
    options.limits.write_stall = 400ms;
    start();
    Client client(front->port(), 32 << 10);
    client.send("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    const std::string image(6 << 20, 'p');
    front->reply(requests[0].first, png(image));
    for (int i = 0; i < 12; ++i) {  // three times as long as a write may take
        ASSERT_TRUE(client.receive());
        std::this_thread::sleep_for(100ms);
    }
    EXPECT_EQ(client.read_response(), 200);
    EXPECT_EQ(client.body.size(), image.size());
}

TEST_F(FrontTest, WhoeverNeverReadsItsStillIsDropped) {
    options.limits.write_stall = 300ms;
    start();
    Client client(front->port(), 64 << 10);
    client.send("GET /v1/frame.png HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    front->reply(requests[0].first, png(std::string(6 << 20, 'p')));
    std::this_thread::sleep_for(900ms);
    // What lies in buffers can still be read, then comes the end: far from all.
    EXPECT_TRUE(client.receive_end());
    EXPECT_LT(client.received.size(), std::size_t{4} << 20);
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

// One that reads now and then gets whole pictures, the newest; one that never reads is dropped; a third feels neither.
TEST_F(FrontTest, SlowReadersOfMjpegGetTheNewestOrAreDropped) {
    options.limits.write_stall = 1500ms;
    start();
    const auto begin = [](Client& client) {
        client.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n");
        return client.receive_until("image/jpeg\r\n\r\n");
    };
    constexpr std::uint32_t kPictures = 30;
    const std::string last(1000, static_cast<char>(kPictures));
    Client slow(front->port(), 64 << 10), deaf(front->port(), 4096), fast(front->port());
    ASSERT_TRUE(begin(slow) && begin(deaf) && begin(fast));
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.jpeg_clients == 3; }));
    std::size_t slow_bytes = 0;
    bool slow_saw_the_last = false;
    std::thread reading([&] {
        for (const auto until = std::chrono::steady_clock::now() + 20s;
             !slow_saw_the_last && !slow.closed && std::chrono::steady_clock::now() < until;) {
            slow.receive(100);
            slow_saw_the_last = slow.received.find(last) != std::string::npos;
            slow_bytes += slow.received.size();
            slow.received.clear();
            std::this_thread::sleep_for(15ms);
        }
    });
    for (std::uint32_t rev = 1; rev <= kPictures; ++rev) {
        EncodedFrame picture = frame(rev, true, 1'000'000);
        std::fill(picture.data.begin(), picture.data.end(), static_cast<std::byte>(rev));
        picture.rendered_ns = rev;
        front->publish_jpeg(picture);
        fast.received.clear();
        EXPECT_TRUE(fast.receive_until("--gonio-frame\r\n")) << "picture " << rev;
        const std::size_t end = fast.received.find("\r\n--gonio-frame");
        EXPECT_TRUE(end != std::string::npos && end > 0 && fast.received[end - 1] == static_cast<char>(rev)) << rev;
    }
    reading.join();
    EXPECT_TRUE(slow_saw_the_last) << "the newest picture";
    EXPECT_LT(slow_bytes, std::size_t{15'000'000}) << "those between were left out, not kept for it";
    EXPECT_TRUE(wait_demand([](const Demand& d) { return d.jpeg_clients == 2; })) << "the deaf one is still there";
}

TEST(HttpRules, HostsAreNamesAndAddressesWithAPort) {
    HttpOptions options;
    options.host = "::";
    using asio::ip::make_address;
    const auto v4 = make_address("192.0.2.2"), mapped = make_address("::ffff:192.0.2.2");
    EXPECT_TRUE(allowed_host("192.0.2.2:8080", options, v4));
    EXPECT_TRUE(allowed_host("192.0.2.2:8080", options, mapped)) << "a dual-stack listener";
    EXPECT_TRUE(allowed_host("[::ffff:192.0.2.2]", options, v4));
    EXPECT_FALSE(allowed_host("192.0.2.3", options, mapped));
    EXPECT_TRUE(allowed_host("[fe80::1]:80", options, make_address("fe80::1%1")));
    EXPECT_TRUE(allowed_host("[::1]:80", options, v4));
    EXPECT_TRUE(allowed_host("app.localhost:80", options, v4));
    for (const char* bad :
         {"localhost:80; script-src *", "[::1]evil", "localhost:evil", "[::1", "", ":80", "localhost:80:80",
          "a;script-src.localhost", "a b.localhost", "'self'.localhost", "\"a\".localhost", "a\t.localhost",
          "*.localhost", "\xc3\xa4.localhost", "[::1 ]", "[::1%lo]"})
        EXPECT_FALSE(allowed_host(bad, options, v4)) << bad;
    options.host_names = {"my_box"};
    EXPECT_TRUE(allowed_host("MY_BOX:80", options, v4)) << "who lists a name means it";
}

}  // namespace
}  // namespace gonio
