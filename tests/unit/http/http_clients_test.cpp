// What the front tells of its clients, and how it says goodbye; over real sockets, the daemon played by the test.
#include <mutex>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/http/http_server.h"
#include "tests/unit/http_client.h"

namespace gonio {
namespace {

using test::Client;
using namespace std::chrono_literals;

class FrontClients : public testing::Test {
protected:
    void SetUp() override {
        HttpOptions options;
        options.port = 0;
        options.tokens = {token, viewer_token};
        HttpServer::Callbacks callbacks;
        callbacks.identified = [this](SessionId session, v1::Identify identify) {
            std::lock_guard lock(mutex);
            identified.emplace_back(session, std::move(identify));
            return takes;
        };
        auto started = HttpServer::start(options, std::move(callbacks));
        ASSERT_TRUE(started) << started.error().text();
        front = std::move(*started);
        front->publish_state(state(1, 0));
    }
    static v1::State state(std::uint32_t rev, std::uint32_t holder) {
        v1::State state;
        state.set_scene_rev(rev);
        state.mutable_control()->set_holder(holder);
        return state;
    }
    void identify(Client& client, const std::string& role, const std::string& shown = "a token of many letters",
                  const std::string& undo_key = "") const {
        ASSERT_EQ(client.upgrade(kSubprotocolJson), 101);
        ASSERT_TRUE(client.read_message());  // Hello
        v1::ClientMessage message;
        message.mutable_identify()->set_client("a page");
        message.mutable_identify()->set_state(true);
        message.mutable_identify()->set_token(shown);
        message.mutable_identify()->set_role(role);
        message.mutable_identify()->set_undo_key(undo_key);
        client.say(message);
    }
    const std::string token = "a token of many letters", viewer_token = "another of as many letters";
    std::mutex mutex;
    std::vector<std::pair<SessionId, v1::Identify>> identified;
    bool takes = true;
    std::unique_ptr<HttpServer> front;
};

TEST_F(FrontClients, WhoTheyAreIsToldWithoutTheToken) {
    Client client(front->port());
    identify(client, "viewer");
    const auto ready = client.read_message();
    ASSERT_TRUE(ready && ready->has_ready());
    std::lock_guard lock(mutex);
    ASSERT_EQ(identified.size(), 1u);
    EXPECT_EQ(identified[0].first, ready->ready().client_id());
    EXPECT_NE(ready->ready().client_id(), 0u);
    EXPECT_EQ(identified[0].second.role(), "viewer");
    EXPECT_EQ(ready->ready().role(), "viewer");
    EXPECT_EQ(identified[0].second.client(), "a page");
    EXPECT_EQ(identified[0].second.token(), "");
}

TEST_F(FrontClients, AViewersTokenMakesAViewerWhateverItAsksFor) {
    for (const char* role : {"", "controller", "viewer"}) {
        Client client(front->port());
        identify(client, role, viewer_token);
        const auto ready = client.read_message();
        ASSERT_TRUE(ready && ready->has_ready()) << role;
        EXPECT_EQ(ready->ready().role(), "viewer") << role;
        std::lock_guard lock(mutex);
        EXPECT_EQ(identified.back().second.role(), "viewer") << role;
        EXPECT_EQ(identified.back().second.token(), "");
    }
    Client wrong(front->port());
    identify(wrong, "viewer", "another of as many lettern");
    EXPECT_FALSE(wrong.read_message());
    EXPECT_EQ(wrong.last.close_code(), 4003);
}

TEST_F(FrontClients, AnUnknownRoleIs4002) {
    Client client(front->port());
    identify(client, "king");
    EXPECT_FALSE(client.read_message());
    EXPECT_EQ(client.last.close_code(), 4002);
    EXPECT_TRUE(identified.empty());
}

TEST_F(FrontClients, AnUndoKeyOfMoreThan64BytesIs4002) {
    Client longest(front->port()), longer(front->port());
    identify(longest, "", token, std::string(64, 'k'));
    const auto ready = longest.read_message();
    ASSERT_TRUE(ready && ready->has_ready());
    {
        std::lock_guard lock(mutex);
        EXPECT_EQ(identified.back().second.undo_key(), std::string(64, 'k'));
    }
    v1::UndoState labels;
    labels.set_undo_label("level of key");
    v1::ServerMessage message;
    *message.mutable_undo_state() = labels;
    front->reply(ready->ready().client_id(), message);
    const auto told = longest.read_message();
    ASSERT_TRUE(told);
    EXPECT_EQ(told->undo_state().undo_label(), "level of key") << "no answer to anything";
    identify(longer, "", token, std::string(65, 'k'));
    EXPECT_FALSE(longer.read_message());
    EXPECT_EQ(longer.last.close_code(), 4002);
    EXPECT_EQ(identified.size(), 1u);
}

TEST_F(FrontClients, WhoCannotBeTakenInIs1013) {
    takes = false;
    Client client(front->port());
    identify(client, "");
    EXPECT_FALSE(client.read_message());
    EXPECT_EQ(client.last.close_code(), 1013);
}

TEST_F(FrontClients, AChangeOfControlArrivesThoughTheRevisionIsKnown) {
    Client client(front->port());
    identify(client, "");
    ASSERT_TRUE(client.read_message());  // Ready, revision 1
    v1::StateChanged old, control;
    old.set_scene_rev(1);
    control.set_scene_rev(1);
    control.set_by(7);
    control.mutable_state()->mutable_control()->set_holder(7);
    front->broadcast(old);
    front->publish_state(state(1, 7));
    front->broadcast(control);
    const auto told = client.read_message();
    ASSERT_TRUE(told && told->has_state_changed());
    EXPECT_EQ(told->state_changed().by(), 7u);
    EXPECT_EQ(told->state_changed().state().control().holder(), 7u);
}

TEST_F(FrontClients, GoodbyeComesAfterTheAnswersAndSaysWhenToComeBack) {
    Client client(front->port());
    identify(client, "");
    const auto ready = client.read_message();
    ASSERT_TRUE(ready && ready->has_ready());
    EXPECT_EQ(ready->ready().role(), "controller");
    v1::ServerMessage answer;
    answer.set_request_id(5);
    answer.mutable_result()->set_code("ok");
    front->reply(ready->ready().client_id(), answer);
    front->stop(1234);
    front->stop(9);
    const auto first = client.read_message(), second = client.read_message();
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->request_id(), 5u);
    EXPECT_EQ(second->goodbye().reconnect_after_ms(), 1234u);
    EXPECT_FALSE(client.read_message());
    EXPECT_EQ(client.last.close_code(), 1001);
}

TEST_F(FrontClients, NobodyNewIsLetInAtTheEnd) {
    Client before(front->port());
    identify(before, "");
    const auto ready = before.read_message();
    ASSERT_TRUE(ready && ready->has_ready());
    front->stop_accepting();
    v1::ServerMessage answer;
    answer.mutable_result()->set_code("ok");
    front->reply(ready->ready().client_id(), answer);
    ASSERT_TRUE(before.read_message()) << "who is there stays";
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(front->port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_NE(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::close(socket);
}

}  // namespace
}  // namespace gonio
