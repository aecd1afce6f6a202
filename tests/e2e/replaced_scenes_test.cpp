// Requests are answered while scenes are replaced: those of the scene that is shown, and those of one that was.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/connection/connection.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/surface.pb.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/mover.h"
#include "tests/e2e/onlooker.h"

namespace gonio::test {
namespace {

using namespace std::chrono_literals;
using Words = std::vector<std::string>;

// An answer that takes longer never comes.
constexpr auto kPatience = 120s;

class ReplacedScenes : public testing::Test {
protected:
    // Somebody looks, and the camera moves all the time.
    void SetUp() override {
        daemon = std::make_unique<DaemonProcess>(Words{"--renderer", "gl", "--size", "160x160"});
        viewer = std::make_unique<Onlooker>(*daemon);
        mover = std::make_unique<Mover>(port_of(daemon->url()), [](v1::Command& command, int step) {
            v1::SetCamera& camera = *command.mutable_set_camera();
            for (const double x : {0.02 * (step % 9), 2.0, 7.0}) camera.add_eye_m(x);
        });
    }
    void TearDown() override {
        mover.reset();
        viewer.reset();  // and the daemon stops, which ends what still waits
        for (auto& [said, request] : asked)
            if (request.valid()) request.wait();
    }
    void ask(Words words) {
        std::string said;
        for (const std::string& word : words) said += word + " ";
        words.insert(words.begin(), {"--server", daemon->url()});
        asked.emplace_back(said, std::async(std::launch::async, [words] { return run_program("gonio", words); }));
    }
    // Waits for all that was asked. undo: may have nothing to undo, which is an answer too.
    void expect_answers() {
        const auto until = std::chrono::steady_clock::now() + kPatience;
        for (auto& [said, request] : asked) {
            if (request.wait_until(until) != std::future_status::ready) {
                ADD_FAILURE() << said << ": no answer";
                continue;
            }
            const Finished finished = request.get();
            if (said != "undo ") {
                EXPECT_EQ(finished.exit_code, 0) << said << finished.err;
            } else {
                EXPECT_LE(finished.exit_code, 1) << said << finished.err;
            }
        }
    }

    TemporaryFolder folder;
    std::unique_ptr<DaemonProcess> daemon;
    std::unique_ptr<Onlooker> viewer;
    std::unique_ptr<Mover> mover;
    std::vector<std::pair<std::string, std::future<Finished>>> asked;
};

TEST_F(ReplacedScenes, CapturesOfTheSceneThatWas) {
    daemon->rev({"load", "scene", "cornell"});
    for (int i = 0; i < 3; ++i) ask({"capture", folder.path("of" + std::to_string(i) + ".png"), "--size", "64x64"});
    std::this_thread::sleep_for(200ms);
    daemon->rev({"load", "scene", "cornell"});
    expect_answers();
    EXPECT_GT(daemon->json({"stats"})["frames_rendered"].get<int>(), 1) << "somebody looked";
}

// Result: a message of every kind that is answered, and a command of every kind. Most are refused, which is an answer.
std::vector<v1::ClientMessage> one_of_each() {
    std::vector<v1::ClientMessage> messages;
    const auto add_kinds = [&](const google::protobuf::OneofDescriptor& kinds, const auto& holder) {
        for (int i = 0; i < kinds.field_count(); ++i) {
            google::protobuf::Message& to = holder(messages.emplace_back());
            to.GetReflection()->MutableMessage(&to, kinds.field(i));
        }
    };
    add_kinds(*v1::ClientMessage::descriptor()->FindOneofByName("message"),
              [](v1::ClientMessage& message) -> google::protobuf::Message& { return message; });
    add_kinds(*v1::Command::descriptor()->oneof_decl(0),
              [](v1::ClientMessage& message) -> google::protobuf::Message& { return *message.mutable_command(); });
    std::erase_if(messages, [](const v1::ClientMessage& message) {
        return message.has_identify() || message.has_frame_ack() || message.has_request_keyframe();
    });
    for (v1::ClientMessage& message : messages) {  // those that would wait, or be refused before they touch the scene
        if (message.has_learn()) message.mutable_learn()->set_timeout_s(0.2);
        if (message.has_capture()) {
            message.mutable_capture()->set_format("png");
            message.mutable_capture()->set_width_px(16), message.mutable_capture()->set_height_px(16);
        }
        if (message.has_meter()) {
            for (const double x : {0.0, 0.01, 0.0}) message.mutable_meter()->add_point_m(x);
            for (const double x : {0.0, 1.0, 0.0}) message.mutable_meter()->add_normal(x);
        }
        if (message.has_lux_report()) {
            message.mutable_lux_report()->set_max_seconds(0.1);
            message.mutable_lux_report()->set_width_px(64);
        }
    }
    return messages;
}

TEST_F(ReplacedScenes, EveryMessageIsAnswered) {
    const std::vector<v1::ClientMessage> messages = one_of_each();
    ASSERT_GT(messages.size(), 60u);
    constexpr std::size_t kClients = 4;
    std::atomic<std::size_t> next{0}, answered{0};
    std::atomic<bool> stop{false};
    std::thread loads([&] {
        for (int i = 0; !stop; ++i) {
            daemon->gonio({"load", "scene", i % 2 == 0 ? "cylinder" : "cornell"});
            std::this_thread::sleep_for(1s);
        }
    });
    std::vector<std::thread> clients;
    for (std::size_t client = 0; client < kClients; ++client)
        clients.emplace_back([&] {
            for (std::size_t i = next++; i < messages.size(); i = next++) {
                auto connection = Connection::open(*parse_server_url(daemon->url()), {});
                ASSERT_TRUE(connection) << connection.error().text();
                const auto began = std::chrono::steady_clock::now();
                const auto answer = (*connection)->ask(messages[i], [](const v1::Progress&) {});
                const bool silent = !answer && answer.error().code == "unreachable";
                EXPECT_FALSE(silent) << messages[i].ShortDebugString();
                EXPECT_LT(std::chrono::steady_clock::now() - began, kPatience) << messages[i].ShortDebugString();
                answered += silent ? 0 : 1;
            }
        });
    for (std::thread& client : clients) client.join();
    stop = true;
    loads.join();
    EXPECT_EQ(answered, messages.size());
}

TEST_F(ReplacedScenes, EveryRequest) {
    const std::vector<Words> requests = {
        {"capture", folder.path("a.png"), "--size", "64x64"},
        {"capture", folder.path("b.exr"), "--view", "illuminance", "--size", "64x64"},
        {"capture", folder.path("c.png"), "--quality", "reference", "--noise", "0.2", "--size", "32x32"},
        {"meter", "--point", "0,0.01,0", "--normal", "0,1,0"},
        {"meter", "--point", "0,0.01,0", "--normal", "0,1,0", "--quality", "rsm"},
        {"meter", "--point", "-1,0.01,-1", "--normal", "0,1,0", "--u", "2,0,0", "--v", "0,0,2", "--count", "4x4"},
        {"pick", "0.5", "0.5"},
        {"report"},
        {"stats"},
        {"get"},
        {"sources"},
        {"undo"},
    };
    std::atomic<bool> stop{false};
    std::atomic<int> refused{0};
    std::thread loads([&] {
        for (int i = 0; !stop && i < 40; ++i) {
            refused += daemon->gonio({"load", "scene", i % 2 == 0 ? "cylinder" : "cornell"}).exit_code;
            std::this_thread::sleep_for(300ms);
        }
    });
    for (const Words& request : requests) {
        ask(request);
        std::this_thread::sleep_for(100ms);
    }
    expect_answers();
    stop = true;
    loads.join();
    EXPECT_EQ(refused, 0);
}

}  // namespace
}  // namespace gonio::test
