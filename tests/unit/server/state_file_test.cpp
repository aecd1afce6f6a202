// The show on disk: written by its own thread, whole or not at all, and tried again where the disk refuses.
#include "server/show/state_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/base/atomic_file.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class StateFileTest : public testing::Test {
protected:
    void SetUp() override {
        char name[] = "/tmp/gonio-state-XXXXXX";
        folder = ::mkdtemp(name);
        path = folder + "/show.json";
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset, 5);
    }
    void TearDown() override { fs::remove_all(folder); }
    void change(double master) {
        v1::Command command;
        command.mutable_set_master()->set_ratio(master);
        ASSERT_TRUE(apply(scene, command, {}));
    }
    static std::string text_of(const std::string& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::optional<saved::Show> on_disk() const {
        auto show = read_show(text_of(path));
        return show ? std::optional(*show) : std::nullopt;
    }
    template <typename Done>
    static bool until(const Done& done, std::chrono::milliseconds time = 5s) {
        for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
            if (done()) return true;
            std::this_thread::sleep_for(5ms);
        }
        return false;
    }
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
        std::sort(names.begin(), names.end());
        return names;
    }
    std::string folder, path;
    Scene scene;
};

TEST_F(StateFileTest, ChangesReachTheDiskAndTheEndIsMarked) {
    StateFile file(path, 20ms, 100ms);
    file.put(scene);
    ASSERT_TRUE(until([&] { return on_disk().has_value(); }));
    EXPECT_FALSE(on_disk()->complete());
    change(0.5);
    file.put(scene);
    ASSERT_TRUE(until([&] { return on_disk() && on_disk()->master_ratio() == 0.5; }));
    change(0.25);
    file.put(scene);
    file.close();
    file.close();
    EXPECT_EQ(on_disk()->master_ratio(), 0.25) << "closing waits for no interval";
    EXPECT_TRUE(on_disk()->complete());
    EXPECT_EQ(on_disk()->scene_rev(), scene.scene_rev);
    EXPECT_EQ(files(), std::vector<std::string>{"show.json"});
    EXPECT_GE(file.told().saves, 3u);
    EXPECT_EQ(file.told().error, "");
}

TEST_F(StateFileTest, ManyChangesAreFewWrites) {
    constexpr auto kPause = 200ms;
    StateFile file(path, kPause, 1s);
    const auto began = std::chrono::steady_clock::now();
    for (int i = 0; i < 100; ++i) {
        change(i / 100.0);
        file.put(scene);
        std::this_thread::sleep_for(2ms);
    }
    const auto pauses = (std::chrono::steady_clock::now() - began) / kPause;
    file.close();
    EXPECT_LE(file.told().saves, pauses + 2) << "one after each pause, and the last";
    EXPECT_EQ(on_disk()->master_ratio(), 0.99);
}

// A disk that takes 200 ms for each write: the second write that begins after a change has it, however long changes go
// on.
TEST_F(StateFileTest, ASlowDiskMakesNoPauseLonger) {
    constexpr auto kDisk = 200ms, kPause = 50ms;
    std::atomic<unsigned> begun{0};
    std::vector<std::uint64_t> written;  // by write: the revision; the file's own thread until it is closed
    std::vector<std::pair<std::uint64_t, unsigned>> put;  // revisions, and how many writes had begun
    StateFile file(path, kPause, 1s, kMaxSavedBytes, [&](const std::string& to, std::string_view bytes) {
        ++begun;
        const auto show = read_show(std::string(bytes));
        written.push_back(show ? show->scene_rev() : 0);
        std::this_thread::sleep_for(kDisk);
        return write_file_atomically(to, bytes);
    });
    double longest_s = 0.0;
    for (int step = 0; begun < 10; ++step) {
        change(0.001 * (step % 900));
        put.emplace_back(scene.scene_rev, begun);
        file.put(scene);
        std::this_thread::sleep_for(10ms);
        longest_s = std::max(longest_s, file.told().unsaved_s);
    }
    EXPECT_GT(longest_s, 0.2) << "it says how long";
    EXPECT_GE(file.told().saves, 3u);
    ASSERT_TRUE(until([&] { return file.told().unsaved_s == 0.0; }));
    EXPECT_EQ(on_disk()->master_ratio(), scene.master_ratio);
    file.close();
    for (const auto& [rev, before] : put) {
        if (before + 1 < written.size()) {
            ASSERT_GE(written[before + 1], rev);
        }
    }
}

// A change that comes while another one waits does not make the wait begin anew.
TEST_F(StateFileTest, WaitingCountsFromTheOldestChange) {
    std::atomic<bool> writing{false}, go_on{false};
    StateFile file(path, 10ms, 1s, kMaxSavedBytes, [&](const std::string& to, std::string_view bytes) {
        writing = true;
        while (!go_on) std::this_thread::sleep_for(1ms);
        return write_file_atomically(to, bytes);
    });
    change(0.1);
    file.put(scene);
    ASSERT_TRUE(until([&] { return writing.load(); }));
    std::this_thread::sleep_for(50ms);
    const double waited_s = file.told().unsaved_s;
    EXPECT_GE(waited_s, 0.05);
    change(0.2);
    file.put(scene);
    EXPECT_GE(file.told().unsaved_s, waited_s);
    go_on = true;
    EXPECT_TRUE(until([&] { return file.told().unsaved_s == 0.0; }));
}

// A disk without room refuses a write in the middle, as this limit does.
TEST_F(StateFileTest, AFullDiskIsSaidAndTriedAgainAndTheOldFileStays) {
    std::signal(SIGXFSZ, SIG_IGN);
    StateFile file(path, 20ms, 60ms);
    file.put(scene);
    ASSERT_TRUE(until([&] { return on_disk().has_value(); }));
    const std::string before = text_of(path);
    rlimit free{};
    getrlimit(RLIMIT_FSIZE, &free);
    const rlimit full{100, free.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
    change(0.5);
    file.put(scene);
    EXPECT_TRUE(until([&] { return !file.told().error.empty(); }));
    EXPECT_NE(file.told().error.find("too large"), std::string::npos) << file.told().error;
    EXPECT_EQ(text_of(path), before);
    EXPECT_EQ(files(), std::vector<std::string>{"show.json"}) << "nothing half lies about";
    setrlimit(RLIMIT_FSIZE, &free);
    EXPECT_TRUE(until([&] { return on_disk()->master_ratio() == 0.5; })) << "without another change";
    EXPECT_TRUE(until([&] { return file.told().error.empty(); }));
}

// What can be undone may take the last room of a disk; the show is worth more.
TEST_F(StateFileTest, TheShowIsWrittenWhereThereIsNoRoomForUndo) {
    std::atomic<bool> room_for_both = false;
    const auto to_disk = [&](const std::string& name, std::string_view bytes) -> Result<bool> {
        const bool full = !room_for_both && name == path && fs::exists(path + kUndoNextEnding);
        return full ? Error{"file_unwritable", "", name, "No space left on device"}
                    : write_file_atomically(name, bytes);
    };
    StateFile file(path, 5ms, 10ms, kMaxSavedBytes, to_disk);
    const auto record = std::make_shared<const UndoRecord>();
    file.put(scene, record);
    ASSERT_TRUE(until([&] { return on_disk().has_value(); }));
    ASSERT_TRUE(until([&] { return file.told().saves == 1; }));
    EXPECT_EQ(file.told().error, "");
    EXPECT_EQ(files(), std::vector<std::string>{"show.json"});
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(file.told().saves, 1u) << "what is on the disk is not written again";
    room_for_both = true;
    change(0.25);
    file.put(scene, record);
    EXPECT_TRUE(until([&] { return fs::exists(path + kUndoEnding); }));
}

// What the next start would refuse to read takes the place of nothing.
TEST_F(StateFileTest, AShowTooLargeToReadIsSaidAndTheOldFileStays) {
    { StateFile(path, 1ms, 10ms).put(scene); }
    const std::size_t most = text_of(path).size() + 1000;
    StateFile file(path, 20ms, 60ms, most);
    const auto group = [&](const char* light) {
        v1::Command command;
        command.mutable_set_group()->set_name(std::string(kMaxNameBytes, 'g'));
        if (*light) command.mutable_set_group()->add_lights(light);
        ASSERT_TRUE(apply(scene, command, {}));
    };
    group(scene.lights[0].name.c_str());
    file.put(scene);
    ASSERT_TRUE(until([&] { return on_disk() && on_disk()->groups_size() == 1; })) << file.told().error;
    const std::string before = text_of(path);
    for (int i = 0; i < 40; ++i) {
        v1::Command command;
        command.mutable_save_preset()->set_name("preset " + std::to_string(i));
        ASSERT_TRUE(apply(scene, command, {}));
    }
    file.put(scene);
    ASSERT_TRUE(until([&] { return !file.told().error.empty(); }));
    EXPECT_NE(file.told().error.find("at most " + std::to_string(most)), std::string::npos) << file.told().error;
    EXPECT_EQ(text_of(path), before);
    EXPECT_EQ(files(), std::vector<std::string>{"show.json"});
    for (int i = 0; i < 40; ++i) {
        v1::Command command;
        command.mutable_remove_preset()->set_name("preset " + std::to_string(i));
        ASSERT_TRUE(apply(scene, command, {}));
    }
    group("");
    file.put(scene);
    EXPECT_TRUE(until([&] { return on_disk()->groups_size() == 0; }));
    EXPECT_TRUE(until([&] { return file.told().error.empty(); }));
}

TEST_F(StateFileTest, AFolderThatIsGoneComesBack) {
    fs::remove_all(folder);
    StateFile file(path, 20ms, 60ms);
    file.put(scene);
    EXPECT_TRUE(until([&] { return !file.told().error.empty(); }));
    fs::create_directory(folder);
    EXPECT_TRUE(until([&] { return on_disk().has_value(); }));
}

TEST_F(StateFileTest, WhoeverReadsSeesAWholeFile) {
    StateFile file(path, 1ms, 10ms);
    file.put(scene);
    ASSERT_TRUE(until([&] { return on_disk().has_value(); }));
    for (int i = 0; i < 300; ++i) {
        change(i / 300.0);
        file.put(scene);
        ASSERT_TRUE(on_disk()) << i;
    }
}

TEST_F(StateFileTest, AKilledWriterLeavesAWholeFile) {
    const std::string texts[] = {std::string(300'000, 'a'), std::string(200'000, 'b')};
    ASSERT_TRUE(write_file_atomically(path, texts[0]));
    for (int round = 0; round < 30; ++round) {
        const pid_t writer = fork();
        if (writer == 0) {
            for (int i = 0;; ++i) (void)write_file_atomically(path, texts[i % 2]);
        }
        std::this_thread::sleep_for(std::chrono::microseconds(997 * round));
        kill(writer, SIGKILL);
        waitpid(writer, nullptr, 0);
        const std::string text = text_of(path);
        ASSERT_TRUE(text == texts[0] || text == texts[1]) << round << ": " << text.size();
    }
}

TEST_F(StateFileTest, NothingIsWrittenOfNothing) {
    { StateFile file(path, 1ms, 10ms); }
    EXPECT_TRUE(files().empty());
    EXPECT_FALSE(read_state_file(path)) << "there is no file yet";
}

TEST_F(StateFileTest, ABadFileIsKeptUnderAnotherName) {
    for (const char* name : {"show.json.bad", "show.json.bad-2"}) {
        std::ofstream(path) << "{\"version\":1,";
        EXPECT_FALSE(read_state_file(path));
        EXPECT_EQ(text_of(folder + "/" + name), "{\"version\":1,");
        EXPECT_FALSE(fs::exists(path));
    }
    std::ofstream(path) << "{\"version\":99}";
    EXPECT_FALSE(read_state_file(path));
    EXPECT_EQ(text_of(path + ".aside"), "{\"version\":99}");
    fs::create_directory(path);
    EXPECT_THROW(read_state_file(path), std::invalid_argument);
}

TEST_F(StateFileTest, APrivateFileStaysPrivate) {
    std::ofstream(path) << "old";
    fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
    ASSERT_TRUE(write_file_atomically(path, "new"));
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_EQ(text_of(path), "new");
}

TEST_F(StateFileTest, LinksLeadToWhatTheyName) {
    fs::create_directory(folder + "/far");
    fs::create_symlink("far/show.json", folder + "/near");
    fs::create_symlink(folder + "/near", folder + "/nearer");
    EXPECT_EQ(behind_links(folder + "/nearer"), folder + "/far/show.json") << "which need not exist";
    EXPECT_EQ(behind_links(path), path);
    fs::create_symlink("round", folder + "/round");
    EXPECT_EQ(behind_links(folder + "/round"), folder + "/round");
}

TEST_F(StateFileTest, OneServersAlone) {
    {
        const auto lock = FileLock::take(path);
        ASSERT_TRUE(lock);
        const auto other = FileLock::take(path);
        ASSERT_FALSE(other);
        EXPECT_EQ(other.error().code, "busy");
        EXPECT_EQ(other.error().where, path);
    }
    EXPECT_EQ(FileLock::take(path)->why_not(), "");
    EXPECT_EQ(fs::status(path + ".lock").permissions() & fs::perms::others_read, fs::perms::others_read)
        << "another user's server asks too";
    EXPECT_NE(FileLock::take(folder + "/gone/show.json")->why_not(), "");
    fs::create_symlink(folder + "/elsewhere", folder + "/other.json.lock");
    EXPECT_NE(FileLock::take(folder + "/other.json")->why_not(), "");
    EXPECT_EQ(FileLock::take(folder)->why_not(), "");
    EXPECT_FALSE(fs::exists(folder + ".lock")) << "nothing is made beside what is no file";
}

TEST_F(StateFileTest, ALinkInTheWayIsNotFollowed) {
    std::ofstream(folder + "/other") << "precious";
    fs::create_symlink(folder + "/other", path + ".part");
    EXPECT_TRUE(write_file_atomically(path, "new"));
    EXPECT_EQ(text_of(folder + "/other"), "precious");
    EXPECT_EQ(text_of(path), "new");
    // What a writer left that was killed, of a show that nobody may write to.
    fs::permissions(path, fs::perms::owner_read);
    std::ofstream(path + ".part") << "half";
    fs::permissions(path + ".part", fs::perms::owner_read);
    EXPECT_TRUE(write_file_atomically(path, "newer"));
    EXPECT_EQ(text_of(path), "newer");
    fs::create_directory(path + ".part");
    EXPECT_FALSE(write_file_atomically(path, "newest"));
    EXPECT_EQ(text_of(path), "newer");
}

}  // namespace
}  // namespace gonio
