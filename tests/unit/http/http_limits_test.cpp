// What happens at each limit of the front, and the small parts that decide it.
#include <sys/resource.h>

#include "protocol/schema/gonio.pb.h"
#include "server/base/token_bucket.h"
#include "server/http/auth_guard.h"
#include "server/http/update_clock.h"
#include "server/session/late_work.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
using namespace std::chrono_literals;
using Time = std::chrono::steady_clock::time_point;

TEST(AuthGuard, FiveFailuresBlockForTheRestOfTheMinute) {
    AuthGuard guard(5);
    const Time start = Time() + 1h;
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(guard.blocked("a", start + 10s).count(), 0) << i;
        guard.failed("a", start + i * 1s);
    }
    EXPECT_EQ(guard.blocked("a", start + 10s), 50s);
    EXPECT_EQ(guard.blocked("b", start + 10s), 0s);
    EXPECT_EQ(guard.blocked("a", start + 60s), 0s);
    guard.failed("a", start + 61s);  // a new minute
    EXPECT_EQ(guard.blocked("a", start + 62s), 0s);
}

TEST(AuthGuard, TheTableIsBounded) {
    AuthGuard guard(1);
    const Time start = Time() + 1h;
    for (std::size_t i = 0; i < AuthGuard::kMaxAddresses + 100; ++i) guard.failed(std::to_string(i), start + i * 1ms);
    EXPECT_EQ(guard.addresses(), AuthGuard::kMaxAddresses);
    EXPECT_EQ(guard.blocked("0", start + 5s).count(), 0) << "the oldest is forgotten";
    EXPECT_GT(guard.blocked(std::to_string(AuthGuard::kMaxAddresses + 99), start + 5s).count(), 0);
}

TEST(TokenBucket, ABurstThenTheRate) {
    TokenBucket bucket(10, 3);
    const Time start = Time() + 1h;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(bucket.take(start).count(), 0);
    EXPECT_EQ(bucket.take(start), 100ms);
    EXPECT_EQ(bucket.take(start + 60ms), 40ms);
    EXPECT_EQ(bucket.take(start + 101ms).count(), 0);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(bucket.take(start + 1h).count(), 0);
    EXPECT_GT(bucket.take(start + 1h).count(), 0) << "what was saved up is bounded";
}

TEST(TokenBucket, WhatWasTakenTooMuchIsWaitedFor) {
    TokenBucket bucket(10, 3);
    const Time start = Time() + 1h;
    EXPECT_EQ(bucket.take(start, 8).count(), 0) << "however much it is, while one is there";
    EXPECT_EQ(bucket.take(start), 600ms);
    EXPECT_EQ(bucket.take(start + 601ms).count(), 0);
}

TEST(UpdateClock, MeasuresFromArrivalToTheFirstFrame) {
    UpdateClock clock;
    const Time start = Time() + 1h;
    std::vector<double> took_ms;
    const auto took = [&](auto time) { took_ms.push_back(std::chrono::duration<double, std::milli>(time).count()); };
    clock.arrived(1, 7, start);
    clock.arrived(1, 0, start);  // never answered
    clock.shown(100, start + 1ms, took);
    EXPECT_TRUE(took_ms.empty()) << "its revision is not known yet";
    EXPECT_TRUE(clock.answered(1, 7, true, 5));
    EXPECT_FALSE(clock.answered(1, 7, true, 5));
    clock.shown(4, start + 10ms, took);
    EXPECT_TRUE(took_ms.empty());
    clock.shown(6, start + 20ms, took);
    clock.shown(7, start + 30ms, took);
    EXPECT_EQ(took_ms, std::vector<double>{20});
    clock.arrived(1, 8, start);
    EXPECT_TRUE(clock.answered(1, 8, false, 0));
    clock.shown(1000, start + 40ms, took);
    EXPECT_EQ(took_ms.size(), 1u) << "a refused one is never shown";
}

TEST(LateWork, WaitsForItsRevisionOrItsTime) {
    LateWork<int> late(2, 1s);
    EXPECT_TRUE(late.add(1, 10, 0));
    EXPECT_TRUE(late.add(2, 8, 500'000'000));
    EXPECT_FALSE(late.add(3, 8, 0));
    EXPECT_FALSE(late.take_due(7));
    EXPECT_EQ(late.take_due(9), 2);
    EXPECT_FALSE(late.take_overdue(999'999'999));
    EXPECT_EQ(late.take_overdue(1'000'000'000), 1);
    EXPECT_TRUE(late.empty());
}

struct FrontLimitsTest : FrontTest {};

TEST_F(FrontLimitsTest, WrongTokensAreCountedThenNothingIsAnswered) {
    options.tokens.all = "0123456789abcdef";
    options.limits.auth_failures = 2;
    start();
    const std::string right = "Authorization: Bearer 0123456789abcdef\r\n", wrong = "Authorization: Bearer x\r\n";
    for (int i = 0; i < 4; ++i) EXPECT_EQ(Client(front->port()).get("/metrics"), 401) << "showing none is no guess";
    EXPECT_EQ(Client(front->port()).get("/metrics", right), 200);
    EXPECT_EQ(Client(front->port()).get("/metrics", wrong), 401);
    Client guesser(front->port());
    ASSERT_EQ(guesser.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(guesser.read_message());
    Client early(front->port());  // gets in before the limit is reached, and identifies after
    ASSERT_EQ(early.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(early.read_message());
    guesser.identify(false, false, "wrong");
    EXPECT_FALSE(guesser.read_message());
    EXPECT_EQ(guesser.last.close_code(), 4003);
    Client blocked(front->port());
    EXPECT_EQ(blocked.get("/metrics", right), 429);
    EXPECT_NE(blocked.head.find("Retry-After: "), std::string::npos);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson), 429);
    early.identify(false, false, "0123456789abcdef");
    EXPECT_FALSE(early.read_message());
    EXPECT_EQ(early.last.close_code(), 4008);
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200) << "what needs no token goes on";
}

TEST_F(FrontLimitsTest, ANewTokenIsAskedForFromNowOn) {
    options.tokens.all = "0123456789abcdef";
    start();
    front->set_tokens({"fedcba9876543210", ""});
    EXPECT_EQ(Client(front->port()).get("/metrics", "Authorization: Bearer fedcba9876543210\r\n"), 200);
    EXPECT_EQ(Client(front->port()).get("/metrics", "Authorization: Bearer 0123456789abcdef\r\n"), 401);
}

TEST_F(FrontLimitsTest, WhoShowedATokenThatHoldsNoMoreIsClosed) {
    options.tokens = {"0123456789abcdef", "0123456789viewer"};
    start();
    Client all(front->port()), looks(front->port()), pictures(front->port());
    const auto identify = [](Client& client, const char* token) {
        ASSERT_EQ(client.upgrade(kSubprotocolJson), 101);
        ASSERT_TRUE(client.read_message());  // Hello
        v1::ClientMessage message;
        message.mutable_identify()->set_token(token);
        client.say(message);
        ASSERT_TRUE(client.read_message());  // Ready
    };
    identify(all, "0123456789abcdef");
    identify(looks, "0123456789viewer");
    pictures.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer 0123456789abcdef\r\n\r\n");
    ASSERT_TRUE(pictures.receive_until("--gonio-frame"));
    // What let do everything lets look only now, and the viewers' token is as before.
    front->set_tokens({"fedcba9876543210", "0123456789viewer"});
    EXPECT_FALSE(all.read_message());
    EXPECT_EQ(all.last.close_code(), 4003);
    EXPECT_TRUE(pictures.receive_end());
    v1::ClientMessage question;
    question.set_request_id(1);
    question.mutable_get_state();
    looks.say(question);
    EXPECT_TRUE(wait_for([&] { return !requests.empty() && requests.back().second.has_get_state(); }));
    // The tokens change places.
    front->set_tokens({"0123456789viewer", "fedcba9876543210"});
    looks.say(question);
    EXPECT_TRUE(wait_for([&] { return requests.size() >= 2; })) << "more right than before is no reason to close";
}

TEST_F(FrontLimitsTest, OneAddressHasItsShare) {
    options.limits.local_clients = 2;
    start();
    Client a(front->port()), b(front->port());
    a.join(kSubprotocolJson, false, false);
    b.join(kSubprotocolJson, false, false);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson), 429);
    EXPECT_EQ(Client(front->port()).get("/v1/mjpeg"), 429);
    EXPECT_EQ(Client(front->port()).get("/v1/frame.png"), 429);
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

TEST_F(FrontLimitsTest, WhoHasNotIdentifiedTakesNoPlaceAndTheOldestMakesRoom) {
    for (const bool by_address : {false, true}) {
        front.reset();
        options.limits.clients = by_address ? 64 : 2;
        options.limits.local_clients = by_address ? 2 : 0;
        start();
        std::vector<std::unique_ptr<Client>> strangers;
        for (int i = 0; i < 4; ++i) {
            strangers.push_back(std::make_unique<Client>(front->port()));
            ASSERT_EQ(strangers.back()->upgrade(kSubprotocolJson), 101);
            ASSERT_TRUE(strangers.back()->read_message()) << "Hello";
        }
        for (int i = 0; i < 2; ++i) {
            EXPECT_FALSE(strangers[i]->read_message());
            EXPECT_EQ(strangers[i]->last.close_code(), 1013) << i;
        }
        Client client(front->port()), late(front->port());
        client.join(kSubprotocolJson, false, false);  // the third stranger leaves
        ASSERT_EQ(late.upgrade(kSubprotocolJson), 101);
        ASSERT_TRUE(late.read_message());
        strangers[3]->identify(false, false);
        const auto ready = strangers[3]->read_message();
        EXPECT_TRUE(ready && ready->has_ready()) << "the newer ones are still there";
        late.identify(false, false);
        EXPECT_FALSE(late.read_message());
        EXPECT_EQ(late.last.close_code(), 1013) << "two clients are there meanwhile";
    }
}

TEST_F(FrontLimitsTest, ConnectionsOverTheLimitAreClosed) {
    options.limits.local_connections = 2;
    start();
    {
        Client a(front->port()), b(front->port());
        ASSERT_EQ(a.get("/healthz"), 200);
        ASSERT_EQ(b.get("/healthz"), 200);
        Client c(front->port());
        EXPECT_TRUE(c.receive_end());
    }
    int status = 0;
    for (int i = 0; i < 100 && status != 200; ++i) {
        std::this_thread::sleep_for(10ms);
        status = Client(front->port()).get("/healthz");
    }
    EXPECT_EQ(status, 200) << "places come back";
}

TEST_F(FrontLimitsTest, CommandsOverTheRateAreToldToSlowDown) {
    options.limits.updates_per_s = 1;
    options.limits.update_burst = 3;
    start();
    Client client(front->port());
    client.join(kSubprotocolJson, false, false);
    v1::ClientMessage command;
    command.mutable_command()->mutable_set_master()->set_ratio(0.5);
    for (std::uint32_t i = 1; i <= 4; ++i) {
        command.set_request_id(i);
        client.say(command);
    }
    const auto answer = client.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->request_id(), 4u);
    EXPECT_EQ(answer->result().code(), "slow_down");
    EXPECT_GT(answer->result().retry_after_ms(), 0u);
    EXPECT_LE(answer->result().retry_after_ms(), 1000u);
    v1::ClientMessage query;
    query.set_request_id(9);
    query.mutable_get_state();
    client.say(query);
    EXPECT_TRUE(wait_for([&] { return requests.size() == 4 && requests.back().second.has_get_state(); }))
        << "queries are not counted";
}

TEST_F(FrontLimitsTest, TheCamerasLeaseCountsLikeACommand) {
    options.limits.updates_per_s = 1;
    options.limits.update_burst = 3;
    start();
    Client client(front->port());
    client.join(kSubprotocolJson, false, false);
    v1::ClientMessage acquire, release;
    acquire.mutable_acquire_control()->set_take(true);
    release.mutable_release_control();
    for (const v1::ClientMessage* message : {&acquire, &release, &acquire, &release}) client.say(*message);
    const auto answer = client.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->result().code(), "slow_down");
    EXPECT_EQ(requests.size(), 3u);
}

TEST_F(FrontLimitsTest, LongMessagesCountBeforeTheyAreRead) {
    options.limits.updates_per_s = 1;
    options.limits.update_burst = 3;
    start();
    for (const std::string_view subprotocol : {kSubprotocolJson, kSubprotocolProto}) {
        Client client(front->port());
        client.join(subprotocol, false, false);
        const bool json = client.encoding == Encoding::json;
        client.send_frame(json ? 1 : 2, "\x01" + std::string(300 << 10, json ? '[' : '\xff'));
        const auto bad = client.read_message();
        ASSERT_TRUE(bad && bad->has_result());
        EXPECT_EQ(bad->result().code(), "bad_message");
        v1::ClientMessage command;
        command.set_request_id(7);
        command.mutable_command()->mutable_load_scene()->set_file(std::string(100 << 10, 'x'));
        client.say(command);
        const auto refused = client.read_message();
        ASSERT_TRUE(refused && refused->has_result());
        EXPECT_EQ(refused->request_id(), 7u);
        EXPECT_EQ(refused->result().code(), "slow_down");
        EXPECT_GT(refused->result().retry_after_ms(), 1000u);
    }
    EXPECT_TRUE(requests.empty());
}

TEST_F(FrontLimitsTest, UnansweredRequestsAreBounded) {
    options.limits.outstanding = 2;
    start();
    Client client(front->port());
    client.join(kSubprotocolJson, false, false);
    v1::ClientMessage query;
    query.mutable_get_state();
    for (std::uint32_t i = 1; i <= 3; ++i) {
        query.set_request_id(i);
        client.say(query);
    }
    auto answer = client.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->request_id(), 3u);
    EXPECT_EQ(answer->result().code(), "busy");
    EXPECT_GT(answer->result().retry_after_ms(), 0u);
    ASSERT_TRUE(wait_for([&] { return requests.size() == 2; }));
    v1::ServerMessage done;
    done.set_request_id(1);
    done.mutable_state();
    front->reply(requests[0].first, done);
    ASSERT_TRUE(client.read_message());
    query.set_request_id(4);
    client.say(query);
    EXPECT_TRUE(wait_for([&] { return requests.size() == 3; }));
}

// A query, and an answer to it with a picture of so many bytes.
v1::ClientMessage capture(std::uint32_t id) {
    v1::ClientMessage query;
    query.set_request_id(id);
    query.mutable_capture()->set_format("exr");
    return query;
}
v1::ServerMessage picture(std::uint32_t id, std::size_t bytes) {
    v1::ServerMessage answer;
    answer.set_request_id(id);
    answer.mutable_capture()->set_image(std::string(bytes, 'x'));
    return answer;
}
// Result: gonio_inflight_bytes; what was sent before has been dealt with by then.
double in_flight(std::uint16_t port) {
    Client scraper(port);
    EXPECT_EQ(scraper.get("/metrics"), 200);
    const std::string name = "\ngonio_inflight_bytes ";
    const std::size_t at = scraper.body.find(name);
    return at == std::string::npos ? -1 : std::stod(scraper.body.substr(at + name.size()));
}

constexpr std::size_t kMore = 8 << 20;  // than the kernel takes for a reader with a small buffer

TEST_F(FrontLimitsTest, AnswersThatWaitForASlowReaderAreBoundedInBytes) {
    options.limits.queued_bytes = 1 << 20;
    options.limits.write_stall = 20s;
    start();
    Client slow(front->port(), 4096);
    slow.join(kSubprotocolProto, false, false);
    slow.say(capture(1));
    slow.say(capture(2));
    ASSERT_TRUE(wait_for([&] { return requests.size() == 2; }));
    front->reply(requests[0].first, picture(1, kMore));    // larger than the bound, alone
    front->reply(requests[0].first, picture(2, 1 << 10));  // does not fit
    EXPECT_GE(in_flight(front->port()), kMore);
    slow.say(capture(3));  // while more than the bound waits
    EXPECT_LT(in_flight(front->port()), kMore + (1 << 10)) << "two refusals wait, no picture";
    {
        std::lock_guard lock(mutex);
        EXPECT_EQ(requests.size(), 2u) << "nothing is rendered for whoever does not read";
    }
    const auto first = slow.read_message();
    ASSERT_TRUE(first && first->has_capture());
    EXPECT_EQ(first->capture().image().size(), kMore);
    for (const std::uint32_t id : {2u, 3u}) {
        const auto refused = slow.read_message();
        ASSERT_TRUE(refused && refused->has_result()) << id;
        EXPECT_EQ(refused->request_id(), id);
        EXPECT_EQ(refused->result().code(), "busy");
        EXPECT_GT(refused->result().retry_after_ms(), 0u);
    }
    slow.say(capture(4));
    ASSERT_TRUE(wait_for([&] { return requests.size() == 3; })) << "who has read is served again";
    front->reply(requests[0].first, picture(4, 1 << 10));
    const auto last = slow.read_message();
    EXPECT_TRUE(last && last->has_capture());
    EXPECT_EQ(in_flight(front->port()), 0);
}

TEST_F(FrontLimitsTest, ARequestIsOutstandingUntilItsAnswerIsSent) {
    options.limits.outstanding = 1;
    options.limits.write_stall = 20s;
    start();
    Client slow(front->port(), 4096);
    slow.join(kSubprotocolProto, false, false);
    slow.say(capture(1));
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    front->reply(requests[0].first, picture(1, kMore));
    EXPECT_GE(in_flight(front->port()), kMore);
    slow.say(capture(2));
    in_flight(front->port());
    const auto first = slow.read_message(), second = slow.read_message();
    ASSERT_TRUE(first && first->has_capture() && second && second->has_result());
    EXPECT_EQ(second->request_id(), 2u);
    EXPECT_EQ(second->result().code(), "busy");
    slow.say(capture(3));
    EXPECT_TRUE(wait_for([&] { return requests.size() == 2; }));
}

TEST_F(FrontLimitsTest, QueriesThatNobodyCanBeAnsweredAreRefused) {
    start();
    Client client(front->port());
    client.join(kSubprotocolJson, false, false);
    for (const char* query :
         {"get_state", "meter", "capture", "report", "stats", "profile", "sources", "patch", "surfaces", "learn"}) {
        client.send_frame(1, std::string("{\"") + query + "\":{}}");
        const auto answer = client.read_message();
        ASSERT_TRUE(answer && answer->has_result()) << query;
        EXPECT_EQ(answer->request_id(), 0u);
        EXPECT_EQ(answer->result().code(), "invalid_argument");
        EXPECT_EQ(answer->result().field(), "request_id");
    }
    client.send_frame(1, R"({"command":{"set_master":{"ratio":0.5}}})");
    client.send_frame(1, R"({"acquire_control":{}})");
    ASSERT_TRUE(wait_for([&] { return requests.size() == 2; }));
    EXPECT_TRUE(requests[0].second.has_command() && requests[1].second.has_acquire_control());
}

TEST_F(FrontLimitsTest, PicturesOverTheSideAreRefused) {
    options.limits.side_px = 1000;
    start();
    Client client(front->port());
    EXPECT_EQ(client.get("/v1/frame.png?size=1001x10"), 400);
    EXPECT_NE(client.body.find("1001x10"), std::string::npos) << client.body;
    Client socket(front->port());
    socket.join(kSubprotocolJson, false, false);
    v1::ClientMessage size;
    size.set_request_id(1);
    size.mutable_command()->mutable_set_size()->set_width_px(10);
    size.mutable_command()->mutable_set_size()->set_height_px(1002);
    socket.say(size);
    const auto answer = socket.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->result().code(), "invalid_argument");
    EXPECT_EQ(answer->result().value(), "10x1002");
}

TEST_F(FrontLimitsTest, HeadersAndMessagesHaveTheirLimits) {
    options.limits.header_bytes = 1 << 10;
    options.limits.identify_bytes = 1 << 10;
    options.limits.message_bytes = 2 << 10;
    start();
    Client wide(front->port());
    EXPECT_EQ(wide.get("/", "X: " + std::string(1100, 'x') + "\r\n"), 431);
    Client unknown(front->port());
    ASSERT_EQ(unknown.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(unknown.read_message());
    unknown.send_frame(1, std::string(1100, ' '));
    EXPECT_FALSE(unknown.read_message());
    EXPECT_EQ(unknown.last.close_code(), 1009);
    Client known(front->port());
    known.join(kSubprotocolJson, false, false);
    known.send_frame(1, std::string(2100, ' '));
    EXPECT_FALSE(known.read_message());
    EXPECT_EQ(known.last.close_code(), 1009);
}

TEST_F(FrontLimitsTest, WithoutFileDescriptorsThePortComesBack) {
    start();
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    Client there(front->port());
    ASSERT_EQ(there.get("/healthz"), 200);
    Client waiting(front->port(), 0, [&] {
        rlimit few = before;
        few.rlim_cur = 4;  // no new descriptor in this process
        ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
    });
    waiting.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_FALSE(waiting.receive(150)) << "nobody can be accepted";
    EXPECT_EQ(there.get("/healthz"), 200) << "who is there is served";
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_EQ(waiting.read_response(), 200) << "accepted once there are descriptors again";
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

TEST_F(FrontLimitsTest, ARendererThatDoesNotComeByIsNotReady) {
    options.limits.stuck = 200ms;
    start();
    front->set_ready(true);
    Client client(front->port());
    EXPECT_EQ(client.get("/readyz"), 200);
    std::this_thread::sleep_for(300ms);
    EXPECT_EQ(client.get("/readyz"), 503);
    EXPECT_EQ(client.get("/healthz"), 200);
    front->came_by();
    EXPECT_EQ(client.get("/readyz"), 200);
}

TEST_F(FrontLimitsTest, AStillKeepsItsPlaceUntilItIsSentAndMuchThatWaitsStopsFurtherOnes) {
    options.limits.clients = 2;
    options.limits.local_clients = 3;
    options.limits.queued_bytes = 1 << 20;
    start();
    const char* const still = "GET /v1/frame.exr HTTP/1.1\r\nHost: localhost\r\n\r\n";
    Client slow(front->port(), 4096);
    slow.send(still);
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    v1::ServerMessage picture;
    picture.mutable_capture()->set_format("exr");
    picture.mutable_capture()->set_image(std::string(std::size_t{8} << 20, 'x'));
    front->reply(requests[0].first, picture);
    EXPECT_TRUE(slow.receive());
    EXPECT_EQ(Client(front->port()).get("/v1/frame.png"), 503) << "8 MiB wait, 4 may";
    {
        Client other(front->port());
        other.join(kSubprotocolJson, false, false);
        EXPECT_EQ(Client(front->port()).get("/v1/mjpeg"), 503) << "the still has a client's place";
    }
    EXPECT_EQ(slow.read_response(), 200);
    EXPECT_EQ(slow.body.size(), std::size_t{8} << 20);
    Client next(front->port());
    next.send(still);
    EXPECT_TRUE(wait_for([&] { return requests.size() == 2; })) << "all was sent";
}

TEST_F(FrontLimitsTest, ReadinessAndMetricsAreTold) {
    start();
    Client client(front->port());
    EXPECT_EQ(client.get("/readyz"), 503);
    front->set_ready(true);
    EXPECT_EQ(client.get("/readyz"), 200);
    Client viewer(front->port());
    viewer.join(kSubprotocolJson, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key(); }));
    front->publish_h264(frame(1, true), true);
    viewer.acknowledge(viewer.read_frame().seq());
    v1::ClientMessage sync;  // after the acknowledgement
    sync.set_request_id(1);
    sync.mutable_stats();
    viewer.say(sync);
    ASSERT_TRUE(wait_for([&] { return !requests.empty(); }));
    EXPECT_EQ(Client(front->port()).upgrade("gonio.v9"), 400);
    ASSERT_EQ(client.get("/metrics"), 200);
    EXPECT_NE(client.head.find("Content-Type: text/plain; version=0.0.4"), std::string::npos);
    for (const char* line : {"# TYPE gonio_encode_seconds histogram", "gonio_encode_seconds_bucket{le=\"0.002\"} 1",
                             "gonio_encode_seconds_count 1", "gonio_clients{transport=\"websocket\"} 1",
                             "gonio_frames_encoded_total{codec=\"h264\",lane=\"shared\"} 1",
                             "gonio_ack_rtt_seconds_count 1", "gonio_ws_rejected_total{reason=\"subprotocol\"} 1",
                             "gonio_http_requests_total{code=\"503\"} 1", "process_resident_memory_bytes "})
        EXPECT_NE(client.body.find(line), std::string::npos) << line << "\n" << client.body;
}

}  // namespace
}  // namespace gonio
