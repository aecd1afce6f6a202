// Four clients who do everything that there is (mixed_operations.h), while goniod is killed and started again on its
// state file: at rest, after which the show has the same hash, and in the middle of everything, after which it is
// whole. Environment: GONIO_MIXED_MINUTES (default: a third of GONIO_SOAK_MINUTES, else a short run), GONIO_MIXED_KILLS
// (default: one a minute, two at least), GONIO_MIXED_SEED (printed; the same seed draws the same operations).
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <thread>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/scene.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/largest_files.h"
#include "tests/soak/footprint.h"
#include "tests/soak/http_answer.h"
#include "tests/soak/mixed_operations.h"
#include "tests/soak/operator.h"

namespace gonio::soak {
namespace {

using namespace std::chrono_literals;
using conformance::Clock;

constexpr int kClients = 4;
constexpr auto kOperationTime = 25ms;  // one operation of one client
constexpr auto kLookAgain = 1s;        // at the lights that there are
constexpr double kMixedMinutes = 0.6;
constexpr double kLongLife = 3.0;  // minutes; in a shorter one caches and undo still fill
constexpr auto kSilence = 60s;     // a request that nothing is said of for longer is lost

double setting(const char* name, double otherwise) {
    const char* text = std::getenv(name);
    return text == nullptr ? otherwise : std::atof(text);
}

double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

// Result: the first lines that differ between two states, but for what is of one run.
std::string difference(v1::State a, v1::State b) {
    std::string texts[2];
    for (v1::State* state : {&a, &b}) {
        state->clear_boot();
        state->clear_restored_rev();
        state->clear_scene_rev();
        state->clear_hash();
        state->clear_control();
        google::protobuf::TextFormat::PrintToString(*state, &texts[state == &b]);
    }
    std::istringstream lines[2] = {std::istringstream(texts[0]), std::istringstream(texts[1])};
    std::string found, line[2];
    for (int count = 0; count < 12 && std::getline(lines[0], line[0]) && std::getline(lines[1], line[1]);)
        if (line[0] != line[1]) {
            found += line[0] + " | " + line[1] + "\n";
            ++count;
        }
    return found.empty() ? "nothing that a state shows" : found;
}

class Mixed : public testing::Test {
protected:
    const unsigned seed_ = static_cast<unsigned>(setting("GONIO_MIXED_SEED", 45));
    const double minutes_ = setting("GONIO_MIXED_MINUTES", setting("GONIO_SOAK_MINUTES", 3 * kMixedMinutes) / 3);
    const int kills_ = static_cast<int>(setting("GONIO_MIXED_KILLS", std::max(2.0, minutes_)));
    const test::TemporaryFolder folder_;
    const std::string state_file_ = folder_.path("show.json");
    Draw draw_{seed_};
    std::unique_ptr<test::DaemonProcess> daemon_;
    std::vector<std::unique_ptr<Operator>> clients_;
    Clock::time_point looked_{};
    std::map<std::string, std::uint64_t> refusals_;
    std::vector<std::uint64_t> done_ = std::vector<std::uint64_t>(operations().size());
    std::vector<double> quick_ms_, slow_ms_;

    void start() {
        daemon_ = std::make_unique<test::DaemonProcess>(
            std::vector<std::string>{"--renderer", "gl", "--size", "160x120", "--max-transport-mib", "256",
                                     "--surfaces", "off", "--state", state_file_});
        const std::uint16_t port = test::port_of(daemon_->url());
        for (const auto& [name, scene] : {std::pair<std::string, std::string>{"soak.gltf", test::floor_gltf(0.5)},
                                          {"hills.glb", test::hills_glb(200)}}) {
            const auto [status, said] = put_upload(port, name, scene);
            ASSERT_TRUE(status == 200 || status == 201) << status << " " << said;
        }
        while (clients_.size() < kClients) clients_.push_back(std::make_unique<Operator>(port));
        look();
    }
    // Whoever was killed has written nothing half, and what it wrote comes back without a word.
    void start_again() {
        start();
        if (HasFatalFailure()) return;
        EXPECT_FALSE(std::filesystem::exists(state_file_ + ".bad")) << "the state file is torn";
        EXPECT_FALSE(std::filesystem::exists(state_file_ + ".aside")) << "not all came back";
        const std::string log = daemon_->log();
        EXPECT_EQ(log.find(" state: "), log.find(" state: restored")) << log.substr(0, 4000);
        EXPECT_EQ(log.find("be undone"), std::string::npos) << log.substr(0, 4000);
    }
    void kill_daemon() {
        clients_.clear();
        ASSERT_TRUE(daemon_->alive());
        ::kill(daemon_->pid(), SIGKILL);
        daemon_.reset();
    }
    v1::State state(bool hash) {
        v1::ClientMessage get;
        get.mutable_get_state()->set_hash(hash);
        const auto answer = clients_[0]->ask(get, 20s);
        EXPECT_TRUE(answer && answer->has_state()) << "no state came";
        return answer ? answer->state() : v1::State();
    }
    void look() {
        draw_.lights = {"group 0"};
        const v1::State now = state(false);
        for (const v1::Light& light : now.lights()) draw_.lights.push_back(light.name());
        looked_ = Clock::now();
    }
    void note(Operator& client) {
        client.listen();
        for (const Answer& answer : client.take_answers()) {
            const Operation& operation = operations()[static_cast<std::size_t>(answer.kind)];
            (operation.slow ? slow_ms_ : quick_ms_).push_back(answer.silent_ms);
            if (answer.code != "ok") ++refusals_[answer.code];
            EXPECT_TRUE(is_expected(operation, answer.code)) << operation.name << ": " << answer.text;
            EXPECT_LT(answer.silent_ms, 1e3 * kSilence.count()) << operation.name;
        }
    }
    void work(std::chrono::duration<double> time) {
        auto next = Clock::now();
        for (const auto until = next + time; Clock::now() < until && !HasFatalFailure(); next += kOperationTime) {
            std::this_thread::sleep_until(next);
            next =
                std::max(next, Clock::now() - kOperationTime);  // what a busy machine could not do is not made up for
            if (Clock::now() - looked_ > kLookAgain) look();
            for (const auto& client : clients_) note(*client);
            Operator& client = *clients_[static_cast<std::size_t>(draw_.whole(0, kClients - 1))];
            const int kind = next_operation(draw_);
            v1::ClientMessage message;
            operations()[static_cast<std::size_t>(kind)].fill(draw_, message);
            if (!client.ready()) continue;
            client.request(std::move(message), kind);
            ++done_[static_cast<std::size_t>(kind)];
            ASSERT_TRUE(client.connected()) << "a client was closed, as it asked for " << operations()[kind].name;
        }
    }
    // Until all is answered, fades and cues have ended, and what is left is on the disk.
    void rest() {
        for (;;) {  // in turns, because whoever answers no ping is dropped
            const auto waits =
                std::find_if(clients_.begin(), clients_.end(), [](const auto& one) { return !one->settle(100ms); });
            if (waits == clients_.end()) break;
            ASSERT_LT((*waits)->longest_silence(), kSilence) << "nothing is said of " << (*waits)->waits_for();
            for (const auto& client : clients_) client->listen();
        }
        for (const auto& client : clients_) note(*client);
        std::uint32_t rev = 0;
        auto since = Clock::now();
        for (const auto until = since + 60s; Clock::now() - since < 2s;) {
            ASSERT_LT(Clock::now(), until) << "it comes to no rest";
            std::this_thread::sleep_for(200ms);
            const v1::State now = state(false);
            if (now.scene_rev() == rev && !now.cue_playback().running()) continue;
            rev = now.scene_rev();
            since = Clock::now();
        }
        v1::ClientMessage ask;
        ask.mutable_stats();
        for (const auto until = Clock::now() + 30s;; std::this_thread::sleep_for(100ms)) {
            const auto answer = clients_[0]->ask(ask, 20s);
            ASSERT_TRUE(answer && answer->has_stats());
            EXPECT_EQ(answer->stats().state_error(), "");
            if (answer->stats().state_unsaved_s() == 0) return;
            ASSERT_LT(Clock::now(), until) << "the state is not written";
        }
    }
    void kill_at_rest() {
        rest();
        if (HasFatalFailure()) return;
        const v1::State before = state(true);
        kill_daemon();
        start_again();
        if (HasFatalFailure()) return;
        const v1::State after = state(true);
        EXPECT_EQ(after.hash(), before.hash()) << difference(before, after);
    }
    // What came back is a show like any other: it stays the same from then on.
    void kill_amid() {
        kill_daemon();
        start_again();
        if (!HasFatalFailure()) kill_at_rest();
    }
};

TEST_F(Mixed, KeepsTheShowWheneverItIsKilled) {
    start();
    ASSERT_FALSE(HasFatalFailure());
    const auto began = Clock::now();
    const auto minute = [&] { return std::chrono::duration<double>(Clock::now() - began).count() / 60; };
    std::vector<Footprint> life;
    for (int kill = 0; kill <= kills_ && !HasFatalFailure(); ++kill) {
        life.clear();
        // The last life takes a third of the time, so that its memory can be judged.
        constexpr double kLastLife = 1.0 / 3.0;
        const double until = kill == kills_ ? minutes_ : minutes_ * (1 - kLastLife) * (kill + 1) / kills_;
        do {
            work(std::chrono::duration<double>(std::clamp(60 * (until - minute()), 1.0, 10.0)));
            if (HasFatalFailure()) return;
            ASSERT_TRUE(daemon_->alive());
            life.push_back(footprint(daemon_->pid(), minute()));
        } while (minute() < until);
        std::printf("mixed: minute %.1f: %.1f MiB resident, %.1f of it anonymous, %zu descriptors\n",
                    life.back().minute, life.back().resident_mib, life.back().anonymous_mib, life.back().descriptors);
        std::fflush(stdout);
        if (kill < kills_) kill % 2 == 0 ? kill_at_rest() : kill_amid();
    }
    if (HasFatalFailure()) return;
    rest();
    const double began_minute = life.front().minute, lived = life.back().minute - began_minute;
    const Growth growth = growth_of(life, {began_minute + 0.25 * lived, began_minute + 0.5 * lived},
                                    {began_minute + 0.75 * lived, life.back().minute});
    if (lived >= kLongLife) {
        EXPECT_LT(growth.ratio(), 0.1) << "memory grows from " << growth.early_mib << " to " << growth.late_mib
                                       << " MiB";
    }
    std::uint64_t all = 0;
    std::string refused, never;
    for (std::size_t i = 0; i < done_.size(); ++i) {
        all += done_[i];
        if (done_[i] == 0) never += " '" + std::string(operations()[i].name) + "'";
    }
    for (const auto& [code, count] : refusals_) refused += " " + code + " " + std::to_string(count);
    std::printf(
        "mixed: seed %u, %.1f min, %d kills, %llu operations of %zu kinds; refused:%s; answers p50 %.1f ms, p99 "
        "%.1f ms, of what takes long %.1f and %.1f ms%s%s\n",
        seed_, minute(), kills_, static_cast<unsigned long long>(all), done_.size(), refused.c_str(),
        percentile(quick_ms_, 0.5), percentile(quick_ms_, 0.99), percentile(slow_ms_, 0.5), percentile(slow_ms_, 0.99),
        never.empty() ? "" : "; never:", never.c_str());
    clients_.clear();
    EXPECT_EQ(daemon_->stop(), 0);
}

}  // namespace
}  // namespace gonio::soak
