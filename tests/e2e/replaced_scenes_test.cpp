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

#include "protocol/schema/command.pb.h"
#include "protocol/schema/scene.pb.h"
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
