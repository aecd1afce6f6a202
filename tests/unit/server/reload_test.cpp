// Reading again at SIGHUP: one after the other, and nobody waits for a disk that hangs.
#include "server/app/reload.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace gonio {
namespace {

using namespace std::chrono_literals;

// A disk that answers when it is told to.
struct SlowDisk {
    std::mutex mutex;
    std::condition_variable changed;
    int answers = 0, begun = 0, at_once = 0, most_at_once = 0;

    Reread read() {
        std::unique_lock lock(mutex);
        ++begun;
        most_at_once = std::max(most_at_once, ++at_once);
        changed.notify_all();
        changed.wait(lock, [&] { return answers > 0; });
        --answers;
        --at_once;
        return {};
    }
    void answer(int count) {
        const std::lock_guard lock(mutex);
        answers += count;
        changed.notify_all();
    }
    bool begins(int count) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, 5s, [&] { return begun >= count; });
    }
};

struct ReloadTest : testing::Test {
    std::shared_ptr<SlowDisk> disk = std::make_shared<SlowDisk>();
    std::shared_ptr<std::atomic<int>> used = std::make_shared<std::atomic<int>>(0);

    std::function<Reread()> read() {
        return [disk = disk] { return disk->read(); };
    }
    std::function<void(const Reread&)> use() {
        return [used = used](const Reread&) { ++*used; };
    }
    bool uses(int count) {
        for (int i = 0; i < 1000 && *used < count; ++i) std::this_thread::sleep_for(5ms);
        return *used == count;
    }
};

TEST_F(ReloadTest, ManyDuringOneAskForOneMore) {
    Reloading reloading(read());
    reloading.begin(use());
    reloading.ask();
    ASSERT_TRUE(disk->begins(1));
    for (int i = 0; i < 5; ++i) reloading.ask();  // each returns while the disk hangs
    disk->answer(1);
    ASSERT_TRUE(disk->begins(2));
    disk->answer(5);
    EXPECT_TRUE(uses(2));
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(disk->begun, 2);
    EXPECT_EQ(disk->most_at_once, 1);
    reloading.ask();
    EXPECT_TRUE(uses(3)) << "and it goes on";
}

TEST_F(ReloadTest, WhatIsAskedForEarlyIsDoneAtTheBegin) {
    Reloading reloading(read());
    reloading.ask();
    std::this_thread::sleep_for(30ms);
    EXPECT_EQ(disk->begun, 0);
    disk->answer(1);
    reloading.begin(use());
    EXPECT_TRUE(uses(1));
}

TEST_F(ReloadTest, TheEndWaitsForNoDisk) {
    const auto began = std::chrono::steady_clock::now();
    {
        Reloading reloading(read());
        reloading.begin(use());
        reloading.ask();
        ASSERT_TRUE(disk->begins(1));
    }
    EXPECT_LT(std::chrono::steady_clock::now() - began, 4s);
    disk->answer(1);
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(*used, 0) << "what comes too late is given to nobody";
}

}  // namespace
}  // namespace gonio
